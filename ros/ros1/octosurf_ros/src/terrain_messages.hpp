#pragma once

#include "settings.hpp"

#include <convex_plane_decomposition_msgs/PlanarTerrain.h>
#include <grid_map_msgs/GridMap.h>
#include <octomap/OcTree.h>
#include <octomap_msgs/Octomap.h>
#include <std_msgs/Header.h>

#include <octosurf/surface.hpp>

namespace octosurf::ros1 {

/// Binary (octomap_message_data()).
octomap_msgs::Octomap octomap_message(const octomap::OcTree& tree, const std_msgs::Header& header);

// As `octosurf export --format grid_map` and `planar_terrain` write them, with the options' foot and slope.
// Throw Error(data) where there is nothing to put into them.
grid_map_msgs::GridMap grid_map_message(const Snapshot& snapshot, const Options& options,
                                        const std_msgs::Header& header);
convex_plane_decomposition_msgs::PlanarTerrain terrain_message(const Snapshot& snapshot,
                                                               const Options& options,
                                                               const std_msgs::Header& header);

}  // namespace octosurf::ros1
