#pragma once

#include "simulation/recording.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::test {

/// The map of a simulated recording, each scan inserted as it comes, and the truth of what was in sight.
struct SimulatedMap {
  explicit SimulatedMap(const simulation::SimulationOptions& options) {
    const simulation::Recording recording(options);
    simulation::Recording::Visibility visibility = recording.visibility();
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const simulation::Readings ideal = recording.ideal(i);
      visibility.add(i, ideal);
      mapper.insert(recording.labelled_scan(i, ideal).scan);
    }
    truth = visibility.truth();
  }

  Mapper mapper{Parameters{}};
  evaluation::Truth truth;
};

}  // namespace octosurf::test
