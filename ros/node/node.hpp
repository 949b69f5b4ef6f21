#pragma once

#include "mapping.hpp"
#include "middleware.hpp"
#include "node_options.hpp"
#include "patches.hpp"
#include "publications.hpp"
#include "services.hpp"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::node {

/// The mapping node: subscribes to scans, transforms and the camera, publishes the map, and has services.
class Node {
 public:
  /// Both must outlive it. Throws as start_of().
  Node(Middleware& middleware, const NodeOptions& options);

  bool failed() const { return mapping_.failed(); }  ///< finish() throws why

  /// Unsubscribes, maps waiting scans unless `hurry`, saves, and returns a line of summary. Throws the
  /// exception that ended mapping.
  std::string finish(const std::function<bool()>& hurry);

 private:
  InputState state();

  const NodeOptions& options_;
  Mapping mapping_;
  std::vector<std::unique_ptr<Subscription>> inputs_;  // /tf_static, /tf, the camera's if any, scans
  std::string mismatch_;                               // of the scans, reported last
  int without_tf_ = 0;                                 // rounds with scans and without transforms
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  bool told_of_scans_ = false;  // that nobody publishes them
  std::optional<Publications> publications_;
  std::optional<Patches> patches_;
  std::optional<Services> services_;
};

}  // namespace octosurf::node
