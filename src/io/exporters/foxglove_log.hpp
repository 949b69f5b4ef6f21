#pragma once

#include <Eigen/Geometry>
#include <ostream>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::io {

/// With its time stamp, s.
using StampedPose = std::pair<double, Eigen::Isometry3d>;

/// Writes a map as an MCAP file of Foxglove's messages (Protobuf), docs/formats.md §2: /surfaces, an entity
/// for each surface and cylinder, and of the scans' poses /tf, one by one, and /trajectory, at once. Frames
/// `map` and `sensor`, metres. A time stamp that is negative, or before the last, is raised to that. `up`:
/// map frame, for the surfaces' slopes. Write errors set the stream's state.
void write_foxglove(std::ostream& out, const Snapshot& snapshot, const Eigen::Vector3d& up,
                    const std::vector<StampedPose>& T_map_sensor);

}  // namespace octosurf::io
