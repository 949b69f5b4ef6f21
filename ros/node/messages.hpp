#pragma once

#include "io/exporters/message_writer.hpp"
#include "planning/questions.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <octosurf/footsteps.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

// The ROS 2 messages written by the node, field by field as in their .msg files; those of octosurf_msgs are
// in ros/octosurf_msgs/msg. `frame` is the map's frame.

namespace octosurf::node {

/// octosurf_msgs/Surfaces. `stamp_ns`: of the last scan mapped.
void write_surfaces(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame,
                    std::int64_t stamp_ns);

/// octosurf_msgs/Stairs; `stairs` are those of the snapshot.
void write_stairs(io::MessageWriter& out, const Stairs& stairs, const Snapshot& snapshot,
                  const std::string& frame, std::int64_t stamp_ns);

/// octosurf_msgs/ContactRegion.
void write_region(io::MessageWriter& out, const planning::FoundRegion& found);

/// octosurf_msgs/Footstep.
void write_footstep(io::MessageWriter& out, const Footstep& step);

/// visualization_msgs/MarkerArray as of Humble: each surface as triangles in its colour, after all that was
/// shown before is deleted.
void write_markers(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame,
                   std::int64_t stamp_ns);

/// octomap_msgs/Octomap, binary: of the leaves that meet `box`, everything if it is empty.
void write_octomap(io::MessageWriter& out, const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                   const std::string& frame, std::int64_t stamp_ns);

/// std_msgs/Float32MultiArray of rows along x and columns along y.
void write_heights(io::MessageWriter& out, const std::vector<float>& heights, std::size_t rows,
                   std::size_t columns);

}  // namespace octosurf::node
