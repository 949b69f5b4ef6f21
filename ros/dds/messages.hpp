#pragma once

#include "io/exporters/message_writer.hpp"
#include "planning/questions.hpp"

#include <cstdint>
#include <octomap/OcTree.h>
#include <span>
#include <string>

#include <octosurf/footsteps.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

// The ROS 2 messages written by the node, field by field as in their .msg files; those of octosurf_msgs are
// in ros/octosurf_msgs/msg. `frame` is the map's frame.

namespace octosurf::dds {

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
void write_markers(io::MessageWriter& out, const Snapshot& snapshot, const std::string& frame);

/// octomap_msgs/Octomap, binary (octomap_message_data()).
void write_octomap(io::MessageWriter& out, const octomap::OcTree& tree, const std::string& frame);

}  // namespace octosurf::dds
