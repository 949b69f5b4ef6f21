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

/// Where a run's first scans have no poses, which do not come from a file or a bag, and a file beside the
/// `inputs` is called like one of poses: throws Error(usage) for two, warns of one. `second`: null if there
/// is none.
void require_poses(const Scan& first, const Scan* second, const std::vector<std::string>& inputs);

/// Warns if nearly all readings lie within a few voxels of the sensor; true if they do.
bool warn_of_units(const Scan& scan, const Parameters& parameters);

/// Says that a scan's readings lie so far apart that no surface bridges them; empty: they do not.
std::string spacing_warning(const Scan& scan, const Parameters& parameters);

/// What scans contradict, or how they would agree far better; empty if none does.
std::string contradiction_text(const RunStatistics& statistics);

/// After a run's summary, warns on stderr of problems with poses, sensor and surfaces. `viewpoint_given`:
/// scans have no poses for that reason.
void print_warnings(const RunStatistics& statistics, const Map& map, bool viewpoint_given);

}  // namespace octosurf
