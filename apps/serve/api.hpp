#pragma once

#include "plan_query.hpp"
#include "serve/http_server.hpp"
#include "serve/served_map.hpp"

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace octosurf {

/// Its answer is a stream of events.
constexpr const char* live_path = "/live";

/// The query of a request's URL, decoded.
using QueryParameters = std::multimap<std::string, std::string>;

/// What `octosurf serve` answers: the page, the map as JSON, a planner's questions, changes. For any thread.
/// GET /api lists the questions.
class Api {
 public:
  using Source = std::function<std::shared_ptr<const ServedMap>()>;  ///< the map as it is now
  explicit Api(Source map) : map_(std::move(map)) {}

  /// Throws Error(usage), naming the parameter, for questions that make no sense, Error(data) where the map
  /// has no answer.
  HttpReply answer(const std::string& path, const QueryParameters& given);

  /// For a client of `live_path`: each call returns what has changed since the one before, at first since the
  /// given revision; the whole map, if none is given or it is of another run; null: no change. Throws
  /// Error(usage).
  std::function<ServedMap::Text()> events(const QueryParameters& given) const;

 private:
  std::string plan(const ServedMap& map, const PlanQuery& query);

  Source map_;
  std::mutex planning_;  ///< of what follows
  std::string planned_for_;
  std::unique_ptr<FootstepPlanner> planner_;  ///< of the map and robot of the last plan
};

}  // namespace octosurf
