#pragma once

#include <octosurf_ros/OctosurfConfig.h>
#include <ros/node_handle.h>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>

namespace octosurf::ros1 {

/// What can be changed while the node maps (cfg/Octosurf.cfg).
using Options = octosurf_ros::OctosurfConfig;

/// What is read once, out of the node's private parameters.
struct Settings {
  std::vector<std::string> cloud_topics, depth_topics;
  std::string fixed_frame = "map";  ///< ~fixed_frame: of the map; its z is up
  std::string map;                  ///< ~map: path without ending; empty: ~save has to name one
  bool resume = true;               ///< ~resume: go on with ~map where it is there
  bool save_at_end = true;          ///< ~save_at_end: save to ~map when the node is asked to end
  int threads = 1;                  ///< ~threads of the mapper
  double tf_history_s = 10;         ///< ~tf_history
  Parameters parameters;            ///< ~mapping/NAME, as docs/parameters.md names them; of a new map
};

/// Throws Error(usage) naming the parameter.
Settings read_settings(const ros::NodeHandle& node);

/// Throws Error(usage) unless +z is up, which planners' messages take for granted.
void require_z_up(const Parameters& parameters, const std::string& where);

}  // namespace octosurf::ros1
