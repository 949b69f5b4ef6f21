#pragma once

#include "mapping.hpp"
#include "middleware.hpp"
#include "node_options.hpp"

#include <memory>
#include <thread>

#include <octosurf/ground_patch.hpp>

namespace octosurf::node {

/// Publishes the ground around the robot at its controller's rate, in a thread of its own, while there are
/// subscribers: `patch`, a GridMap along the map's axes, and `heights`, flat and in the robot's heading, for
/// a policy.
class Patches {
 public:
  Patches(Middleware& middleware, Mapping& mapping, const NodeOptions& options);

 private:
  void run(const std::stop_token& stop);
  void publish(const GroundView& view);

  Mapping& mapping_;
  const NodeOptions& options_;
  PatchLayout heading_, square_;  // of the two topics
  Eigen::Index side_ = 0;         // cells of the square's
  std::unique_ptr<Publisher> patch_, heights_;
  std::jthread thread_;
};

}  // namespace octosurf::node
