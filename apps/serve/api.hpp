#pragma once

#include "serve/http_reply.hpp"
#include "serve/questions.hpp"
#include "serve/served_map.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <octosurf/footsteps.hpp>

namespace octosurf {

/// A client that follows the map, and the revision that it has, of `run`.
struct Follower {
  std::optional<std::uint64_t> known;
  std::string run;
};

/// What `octosurf serve` answers: the page, the map as JSON, a planner's questions, what changes. From any
/// thread. GET /api lists the questions.
class Api {
 public:
  using Source = std::function<std::shared_ptr<const ServedMap>()>;  ///< the map as it is now
  explicit Api(Source map) : map_(std::move(map)) {}

  /// Throws Error(usage) for questions that make no sense, Error(data) where there is nothing of what is
  /// asked about.
  HttpReply answer(const std::string& path, const QueryParameters& given);
  /// Whether the answer may take seconds.
  static bool is_slow(const std::string& path);

  /// Who asks for `live_path`. Throws Error(usage).
  Follower follower(const QueryParameters& given) const;
  /// What has changed since the revision that it has, or everything, if that is none or another run's; it has
  /// the event from now on. Null: nothing has changed.
  ServedMap::Text next_event(Follower& follower);

 private:
  std::string plan(const ServedMap& map, const Values& values);

  Source map_;
  std::mutex planning_;  ///< of what follows
  std::string planned_for_;
  std::unique_ptr<FootstepPlanner> planner_;  ///< of the map and robot that a plan was last asked for
};

}  // namespace octosurf
