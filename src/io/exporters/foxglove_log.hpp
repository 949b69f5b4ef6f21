#pragma once

#include "io/exporters/mcap_writer.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <ostream>
#include <span>
#include <string>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace google::protobuf {
class Message;
}

namespace octosurf::io {

/// Writes a map as an MCAP file of Foxglove's messages (Protobuf),
/// docs/formats.md §2. Frames `map` and `sensor`, metres. Times are seconds; a negative time, or one before
/// the last, is raised to that. Write errors set the stream's state.
class FoxgloveLog {
 public:
  /// `up`: map frame, for the surfaces' slopes.
  FoxgloveLog(std::ostream& out, const Eigen::Vector3d& up) : file_(out), up_(up) {}

  /// /tf: the sensor's pose.
  void add_pose(double stamp_s, const Eigen::Isometry3d& T_map_sensor);
  /// /trajectory: all poses at once.
  void add_trajectory(double stamp_s, std::span<const Eigen::Isometry3d> T_map_sensor);
  /// /surfaces: an entity for each surface and cylinder. Cost: simplified() and a triangulation for each.
  void add_surfaces(double stamp_s, const Snapshot& snapshot);
  /// /voxels: the box of the occupied ones, in cells of a voxel or of 2ⁿ to an edge, at most 2²³.
  void add_voxels(double stamp_s, const OccupancyView& octree, const Snapshot& snapshot);

  void finish() { file_.finish(); }

 private:
  std::uint64_t time_ns(double stamp_s);
  void write(const char* topic, const google::protobuf::Message& message, std::uint64_t time_ns);

  McapWriter file_;
  Eigen::Vector3d up_;
  std::map<std::string, std::uint16_t> channels_;  ///< by topic
  std::uint64_t last_ns_ = 0;
};

}  // namespace octosurf::io
