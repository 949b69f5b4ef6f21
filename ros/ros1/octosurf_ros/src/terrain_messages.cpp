#include "terrain_messages.hpp"

#include <algorithm>
#include <numbers>
#include <string>

#include <octosurf/adapters/octomap_files.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::ros1 {
namespace {

constexpr double degree = std::numbers::pi / 180;

HeightGrid heights(const Snapshot& snapshot, const Options& options) {
  HeightGridOptions wanted;
  wanted.cell = options.cell;
  wanted.max_slope_rad = options.max_slope * degree;
  return height_grid(snapshot, wanted);
}

/// A message out of the library's bytes: whatever is not read of them is a difference in its definition.
template <class Message>
Message decoded(std::string bytes, const char* type) {
  Message message;
  ros::serialization::IStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(stream, message);
  if (stream.getLength() != 0)
    throw Error(Error::Kind::data, type, "has another definition here than in the library");
  return message;
}

PlannerContact contact_of(const Options& options) {
  PlannerContact contact;
  contact.shape = ContactShape::disc(options.foot_radius);
  contact.limits.max_slope_rad = options.max_slope * degree;
  contact.limits.clearance_m = options.clearance;
  contact.limits.gap_depth_m = options.gap_depth;
  return contact;
}

}  // namespace

octomap_msgs::Octomap octomap_message(const octomap::OcTree& tree, const std_msgs::Header& header) {
  const std::string bytes = octomap_message_data(tree);
  octomap_msgs::Octomap message;
  message.header = header;
  message.binary = true;
  message.id = tree.getTreeType();
  message.resolution = tree.getResolution();
  message.data.assign(bytes.begin(), bytes.end());
  return message;
}

grid_map_msgs::GridMap grid_map_message(const Snapshot& snapshot, const Options& options,
                                        const std_msgs::Header& header) {
  auto message = decoded<grid_map_msgs::GridMap>(
      octosurf::grid_map_message(heights(snapshot, options), header.frame_id, MessageEncoding::ros1),
      "grid_map_msgs/GridMap");
  message.info.header.stamp = header.stamp;
  return message;
}

convex_plane_decomposition_msgs::PlanarTerrain terrain_message(const Snapshot& snapshot,
                                                               const Options& options,
                                                               const std_msgs::Header& header) {
  const auto surfaces = planner_surfaces(snapshot, contact_of(options), &snapshot.octree);
  auto message = decoded<convex_plane_decomposition_msgs::PlanarTerrain>(
      planar_terrain_message(surfaces, heights(snapshot, options), header.frame_id, MessageEncoding::ros1),
      "convex_plane_decomposition_msgs/PlanarTerrain");
  message.gridmap.info.header.stamp = header.stamp;
  return message;
}

}  // namespace octosurf::ros1
