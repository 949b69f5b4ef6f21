#pragma once

#include "run_statistics.hpp"

#include <string>
#include <vector>

#include <octosurf/map.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

/// To stderr, before a run's first scan is mapped: what of it would make the map worthless or dear. `inputs`:
/// of the run; `poses_given`: by a file, so that all come from there. True if nearly all
/// readings lie within a few voxels of the sensor.
bool warn_of_first_scan(const Scan& scan, const std::vector<std::string>& inputs, bool poses_given,
                        const Parameters& parameters);

/// To stderr, after a run's summary: what about its poses, its sensor and its surfaces the user should look
/// at. `reported`: there is a report, which lists the double layers.
void print_warnings(const RunStatistics& statistics, const Map& map, bool reported);

}  // namespace octosurf
