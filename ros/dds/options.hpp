#pragma once

#include "parameter_options.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <octosurf/footsteps.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::dds {

/// What the node was started with.
struct NodeOptions {
  std::uint32_t domain = 0;
  std::string cloud, depth;                    ///< topics; one of them is given
  std::optional<std::string> info;             ///< CameraInfo of the depth images; empty: beside them
  std::optional<double> depth_scale;           ///< units per metre; empty: by the encoding
  std::string frame = "map";                   ///< the map's, in tf
  double max_pose_gap_s = 0.25;                ///< as for bags
  ScanSourceOptions readings;                  ///< no_return, self_boxes, clear_no_return_m, sensor
  double wait_s = 1;                           ///< for a scan's pose and camera
  bool reliable = false;                       ///< request lost scans again
  std::size_t queue_mb = 256;                  ///< scans that wait
  std::string output;                          ///< stem of the map
  bool resume = false;                         ///< resume it, if it is there
  double checkpoint_s = 60;                    ///< 0: never
  std::string name = "/octosurf";              ///< before the topics and services
  double publish_s = 1;                        ///< between two publications of the map
  double foot_radius_m = 0.06;                 ///< of PlanarTerrain's insets
  double max_slope_deg = 30;                   ///< of them and of GridMap
  double clearance_m = Quadruped().body.to_m;  ///< over such a foot; 0: not checked
  int threads = 1;
  ParameterOptions parameters;

  bool takes_depth() const { return !depth.empty(); }
  const std::string& scans() const { return takes_depth() ? depth : cloud; }
};

}  // namespace octosurf::dds
