#pragma once

#include "scan_feed.hpp"

#include <Eigen/Geometry>
#include <string>

#include <octosurf/map.hpp>

namespace octosurf {

/// The frame of a recording's poses in a map's, found by its first scans (Localizer::find()); says where, if
/// it may. Throws Error(data), with the places, if none or several fit, or too little was seen.
Eigen::Isometry3d locate(const Map& map, const std::string& name, ScanFeed recording, bool upright,
                         bool says = true);

}  // namespace octosurf
