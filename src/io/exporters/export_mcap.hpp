#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::io {

struct McapMessage {
  std::string topic, type;  ///< all of a topic are of one type
  std::uint64_t time_ns = 0;
  std::string bytes;
};

/// Writes an MCAP file (mcap.dev/spec) of Protobuf messages, whose types the FileDescriptorSet `descriptors`
/// defines: one chunk (zstd) with its indices, and a summary. Debian has no library for it.
void write_mcap(std::ostream& out, const std::vector<McapMessage>& messages, const std::string& descriptors);

/// With its time stamp, s.
using StampedPose = std::pair<double, Eigen::Isometry3d>;

/// Writes a map as an MCAP file of Foxglove's messages (docs/formats.md §2). A time stamp that is negative,
/// or before the last, is raised to that. `up`: map frame, for slopes. Write errors set the stream's state.
void write_foxglove(std::ostream& out, const Snapshot& snapshot, const Eigen::Vector3d& up,
                    const std::vector<StampedPose>& T_map_sensor);

}  // namespace octosurf::io
