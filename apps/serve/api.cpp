#include "serve/api.hpp"

#include "answers.hpp"
#include "geometry/degrees.hpp"
#include "plan_query.hpp"

#include <chrono>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include <octosurf/plan_files.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
// Shutdown waits for running requests.
constexpr std::chrono::seconds longest_answer{20};

std::string regions_answer(const ServedMap& map, planning::ContactQuestion question) {
  std::string answer = "{\"revision\":" + std::to_string(map.asked.snapshot->revision);
  answer += ",\"regions\":[";
  const char* before = "";
  const auto end = std::chrono::steady_clock::now() + longest_answer;
  for (const SurfacePtr& surface : map.asked.snapshot->surfaces) {
    if (std::chrono::steady_clock::now() > end)
      throw Error(Error::Kind::usage, "clearance_m", "takes too long on all surfaces of this map",
                  "ask /api/regions surface by surface, or give clearance_m=0");
    question.surface = surface->id;
    answer.append(before).append(region_json(planning::find_region(map.asked, question)));
    before = ",";
  }
  return answer.append("]}");
}

std::string answer_to(const ServedMap& map, const std::string& path, const AskedByUrl& asked) {
  if (path == "/api/query/foothold") return foothold_json(planning::find_foothold(map.asked, asked.contact));
  if (path == "/api/regions") return region_json(planning::find_region(map.asked, asked.contact));
  if (path == "/api/regions/all") return regions_answer(map, asked.contact);
  if (path == "/api/surface") return map.surface_json(asked.surface);
  if (path == "/api/changes") return map.changes_json(*asked.since, asked.box);
  const planning::PlaceAnswer found = planning::answer(map.asked, asked.place);
  require_found(map.asked, asked.place, found);
  return place_json(map.asked, asked.place, found);
}

}  // namespace

HttpReply Api::answer(const std::string& path, const QueryParameters& given) {
  const std::shared_ptr<const ServedMap> map = map_();
  if (const UrlQuestion* question = find_question(path)) {
    try {
      AskedByUrl asked;
      read(*question, given, asked);
      return reply_of((path == "/api/plan" ? plan(*map, asked.plan) : answer_to(*map, path, asked)) + "\n");
    } catch (const Error& error) {  // told in the question's words, not the command line's
      if (error.kind() != Error::Kind::usage) throw;
      return refusal(400, error, parameter_of(*question, error.where()));
    }
  }
  if (path == "/") return {200, "text/html; charset=utf-8", map->page.get()};
  if (path == "/api") return reply_of(Json{{"questions", list_of_questions()}}.dump(1) + "\n");
  if (path == "/api/info") return {200, "application/json", map->info.get()};
  if (path == "/api/surfaces") return {200, "application/json", map->surfaces.get()};
  if (path == "/api/voxels") return {200, "application/octet-stream", map->voxels.get()};
  return refusal(404, "there is no such page", path.substr(0, 64), "GET /api lists the questions");
}

HttpReply Api::clear(const std::string& body) {
  if (!clear_)
    return refusal(403, "this server does not change its map", clear_path,
                   "map --serve with --allow-clear does; octosurf clear changes a saved map");
  AskedByUrl asked;
  read(*find_question(clear_path), parameters_in(body), asked);
  if (asked.box.has_value() == asked.cylinder.has_value())
    throw Error(Error::Kind::usage, "box", asked.box ? "is given with a cylinder" : "is missing",
                "give a box or a cylinder");
  return clear_(asked.box ? SpacePart::box(*asked.box) : *asked.cylinder, asked.as_free);
}

Follower Api::follower(const QueryParameters& given) const {
  AskedByUrl asked;
  read(*find_question(live_path), given, asked);
  return {asked.since, asked.run};
}

ServedMap::Text Api::next_event(Follower& follower) {
  const std::shared_ptr<const ServedMap> map = map_();
  const std::uint64_t revision = map->asked.snapshot->revision;
  if (follower.run != map->run.name || follower.known > revision) follower.known.reset();
  if (follower.known == revision) return nullptr;
  ServedMap::Text event = map->changes_event(follower.known);
  follower = {revision, map->run.name};
  return event;
}

std::string Api::plan(const ServedMap& map, const PlanQuery& query) {
  const Robot robot = robot_of(query, map.asked.up);
  Json key{map.asked.snapshot->revision, name_of(robot), query.unknown_is_free};
  if (query.foot) {
    key.push_back(query.foot->radius);
    for (const Eigen::Vector2d& corner : query.foot->outline) key.push_back(corner);
  }
  for (const auto& [limit, value] : query.limits) key.push_back({limit->name, value});
  const std::lock_guard lock(planning_);
  if (planned_for_ != key.dump()) {
    planner_ = std::make_unique<FootstepPlanner>(planner_on(map.asked, robot));
    planned_for_ = key.dump();
  }
  return to_json(planner_->plan(query.from, query.to, query.budget), robot);
}

}  // namespace octosurf
