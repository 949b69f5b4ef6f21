#pragma once

#include "serve/http_message.hpp"
#include "serve/served_map.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include <octosurf/footsteps.hpp>

namespace octosurf {

class Values;

/// What `octosurf serve` answers: the page, the map as JSON, a planner's questions. GET /openapi.json says
/// how it is asked.
class Api {
 public:
  /// The map as it is now; from any thread.
  using Source = std::function<std::shared_ptr<const ServedMap>()>;
  explicit Api(Source map) : map_(std::move(map)) {}

  /// From any thread. Throws Error(usage) for questions that make no sense, Error(data) where there is
  /// nothing of what is asked about.
  HttpReply answer(const HttpRequest& request);
  /// Whether the answer may take seconds.
  static bool is_slow(const HttpRequest& request);

 private:
  std::string plan(const ServedMap& map, const Values& values);

  Source map_;
  std::mutex planning_;  ///< of what follows
  std::string planned_for_;
  std::unique_ptr<FootstepPlanner> planner_;  ///< of the map and robot that a plan was last asked for
};

}  // namespace octosurf
