#pragma once

#include "bench/speed/row.hpp"
#include "simulation/simulate.hpp"

#include <functional>
#include <limits>
#include <string>

#include <octosurf/scan.hpp>

namespace octosurf::bench {

/// Scans that are read or simulated one at a time, in the process that lets the contestants run.
struct ScanSet {
  std::string name;                                                         ///< "kitchen"
  double max_range = std::numeric_limits<double>::infinity();               ///< m
  std::function<void(const std::function<void(const Scan&)>& visit)> each;  ///< may throw Error(data)
};

inline constexpr double camera_range = 4;  // m

/// The kitchen of ../shared/data or options.input: `frames` of it, every options.every-th.
ScanSet kitchen_scans(const SpeedOptions& options, std::size_t frames);
/// The hall of lidar_balm_realworld.
ScanSet hall_scans(std::size_t frames);
/// A simulated recording, its first `frames` scans.
ScanSet simulated_scans(const simulation::SimulationOptions& simulation, std::size_t frames);

/// {"resolution": …, "max_range": … or null}
Json settings_for(const ScanSet& scans, double resolution);

}  // namespace octosurf::bench
