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
  using Clear = std::function<HttpReply(const SpacePart&, bool as_free)>;
  /// `clear` takes back a part of the map; none: nobody may.
  explicit Api(Source map, Clear clear = {}) : map_(std::move(map)), clear_(std::move(clear)) {}

  /// Throws Error(usage) for questions that make no sense, Error(data) where the map has no answer.
  HttpReply answer(const std::string& path, const QueryParameters& given);

  /// What was posted to `clear_path`. Throws Error(usage) likewise.
  HttpReply clear(const std::string& body);

  /// A new client of `live_path`. Throws Error(usage).
  Follower follower(const QueryParameters& given) const;
  /// The changes since the follower's revision; everything, if it has none or one of another run. Moves the
  /// follower to the map's revision. Null: no change.
  ServedMap::Text next_event(Follower& follower);

 private:
  std::string plan(const ServedMap& map, const PlanQuery& query);

  Source map_;
  Clear clear_;
  std::mutex planning_;  ///< of what follows
  std::string planned_for_;
  std::unique_ptr<FootstepPlanner> planner_;  ///< of the map and robot of the last plan
};

}  // namespace octosurf
