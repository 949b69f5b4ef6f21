#pragma once

#include "parameter_options.hpp"

#include <cstddef>
#include <optional>
#include <string>

#include <octosurf/footsteps.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan_source.hpp>

namespace CLI {
class App;
}

namespace octosurf::node {

/// What the node was started with.
struct NodeOptions {
  std::string cloud, depth;           ///< topics; one of them is given
  std::optional<std::string> info;    ///< CameraInfo of the depth images; empty: beside them
  std::optional<double> depth_scale;  ///< units per metre; empty: by the encoding
  std::string frame = "map";          ///< the map's, in tf
  std::string tf = "/tf";             ///< topic of transforms; of the fixed ones with _static
  std::string base = "base_link";     ///< the robot's, about which patches are read
  ScanSourceOptions readings;         ///< no_return, self_boxes, sensor
  double wait_s = 1;                  ///< for a scan's pose and camera
  bool reliable = false;              ///< request lost scans again
  std::size_t queue_mb = 256;         ///< scans that wait
  std::string output;                 ///< stem of the map
  bool resume = false;                ///< resume it, if it is there
  bool force = false;                 ///< start a new map, and overwrite it
  double checkpoint_s = 60;           ///< 0: never
  std::string name = "/octosurf";     ///< before the topics and services
  double publish_s = 1;               ///< between two publications of the map
  double radius_m = 8;                ///< around the robot in which the map is published; 0: everything
  double grid_cell_m = 0.05;          ///< of GridMap and PlanarTerrain, at least the map's resolution
  double patch_hz = 50;               ///< of patches; 0: none
  double patch_length_m = 1.6, patch_width_m = 1, patch_cell_m = 0.05;
  double foot_radius_m = 0.06;                 ///< of PlanarTerrain's insets
  double max_slope_deg = 30;                   ///< of them and of GridMap
  double clearance_m = Quadruped().body.to_m;  ///< over such a foot; 0: not checked
  int threads = 1;
  ParameterOptions parameters;

  bool takes_depth() const { return !depth.empty(); }
  const std::string& scans() const { return takes_depth() ? depth : cloud; }
};

/// Adds a flag for each.
void add_options(CLI::App& app, NodeOptions& options);

/// A new map, or the one that is there to be resumed. Throws Error(usage) if options are missing or do not
/// fit it, and as load_map().
Map start_of(const NodeOptions& options);

}  // namespace octosurf::node
