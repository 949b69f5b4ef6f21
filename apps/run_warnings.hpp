#pragma once

#include "run_statistics.hpp"

#include <string>
#include <vector>

#include <octosurf/map.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// Throws Error(data) for a lidar's scan whose readings reach farther than one sees, unless max_range is
/// given.
void require_metres(const Scan& scan, const Parameters& parameters);

/// Before a run's first scan is mapped, warns on stderr of problems that would make the map useless or
/// expensive. `inputs`: of the run; `poses_given`: by a file or a bag, so that all come from there. True if
/// nearly all readings lie within a few voxels of the sensor.
bool warn_of_first_scan(const Scan& scan, const std::vector<std::string>& inputs, bool poses_given,
                        const Parameters& parameters);

/// By how much a run exceeded the map's limit of memory; empty if it did not.
std::string memory_warning(const Map& map);

/// What scans contradict, or how they would agree far better; empty if none does.
std::string contradiction_text(const RunStatistics& statistics);

/// After a run's summary, warns on stderr of problems with poses, sensor, surfaces and memory. `reported`: a
/// report exists, which lists the double layers.
void print_warnings(const RunStatistics& statistics, const Map& map, bool reported);

}  // namespace octosurf
