#pragma once

#include "support/testing.hpp"

#include <ostream>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {

/// What has happened in a map while it was made, counted over all its scans.
struct Seen {
  std::size_t surfaces = 0, waiting = 0, holes = 0, observed = 0, cylinders = 0, cylinders_gone = 0;
  std::size_t vanished = 0, corrected = 0, seen_again = 0;
};

/// Scans of one kind, and the parameters that they are mapped with.
struct World {
  const char* name;
  Parameters parameters;
  std::vector<Scan> (*scans)();
  std::vector<std::size_t Seen::*> shows;  ///< happens in it, else it is no scene for this
};

const std::vector<World>& worlds();
inline void PrintTo(const World& world, std::ostream* out) { *out << world.name; }

/// A world mapped scan by scan, by one thread, without a stop.
struct Mapped {
  std::vector<Scan> scans;
  std::vector<std::string> bytes;               ///< of the map file after each scan
  std::vector<std::vector<SurfaceId>> grown;    ///< of each scan's report
  std::vector<std::vector<std::string>> wrong;  ///< broken invariants after each scan
  Seen seen;
  Map map;
};

/// Made once in a process for each seed.
const Mapped& run_of(const World& world);

}  // namespace octosurf::test
