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

Eigen::Vector3d point_of(const Values& values, const std::string& name) {
  const std::vector<double> v = values.numbers(name);
  return {v[0], v[1], v[2]};
}

SlopeLimit slope_limit(const ServedMap& map, const Values& values) {
  return {map.asked.up, values.number("max_slope_deg") * rad_per_deg};
}

std::string found_json(const ServedMap& map, const std::optional<Nearest>& found, const char* without) {
  if (!found)
    throw Error(Error::Kind::data, map.asked.name, without,
                "allow a greater max_slope_deg, or map more scans");
  return nearest_json(*found, *map.asked.snapshot->find(found->id), map.asked.up);
}

planning::ContactQuestion contact_question(const Values& values) {
  planning::ContactQuestion question;
  const auto number = [&values](const char* name, double unit = 1) {
    return values.has(name) ? std::optional(values.number(name) * unit) : std::nullopt;
  };
  question.robot = values.text("robot");
  if (values.has("foot")) question.foot = planning::foot_of(values.text("foot"));
  question.yaw_rad = number("yaw_deg", rad_per_deg);
  question.max_slope_rad = number("max_slope_deg", rad_per_deg);
  question.edge_margin_m = number("edge_margin_m");
  question.frontier_margin_m = number("frontier_margin_m");
  question.obstacle_margin_m = number("obstacle_margin_m");
  question.clearance_m = number("clearance_m");
  question.as_mapped = values.number("as_mapped") > 0;
  return question;
}

std::string foothold_answer(const ServedMap& map, const Values& values) {
  planning::ContactQuestion question = contact_question(values);
  question.at = point_of(values, "point");
  const planning::FoundFoothold found = planning::find_foothold(map.asked, question);
  return foothold_json(found.foothold, found.ground);
}

std::string region_answer(const ServedMap& map, const Values& values) {
  planning::ContactQuestion question = contact_question(values);
  question.surface = static_cast<SurfaceId>(values.number("surface"));
  question.pieces = static_cast<std::size_t>(values.number("pieces"));
  if (values.has("about")) question.at = point_of(values, "about");
  question.reach_m = values.number("reach_m");
  const planning::FoundRegion found = planning::find_region(map.asked, question);
  return region_json(*found.surface, found.region, found.pieces);
}

std::string all_regions_answer(const ServedMap& map, const Values& values) {
  planning::ContactQuestion question = contact_question(values);
  std::string answer = "{\"revision\":" + std::to_string(map.asked.snapshot->revision);
  answer += ",\"regions\":[";
  const char* before = "";
  const auto end = std::chrono::steady_clock::now() + longest_answer;
  for (const SurfacePtr& surface : map.asked.snapshot->surfaces) {
    if (std::chrono::steady_clock::now() > end)
      throw Error(Error::Kind::usage, "clearance_m", "takes too long on all surfaces of this map",
                  "ask /api/regions surface by surface, or give clearance_m=0");
    question.surface = surface->id;
    const planning::FoundRegion found = planning::find_region(map.asked, question);
    answer.append(before).append(region_json(*found.surface, found.region, found.pieces));
    before = ",";
  }
  return answer.append("]}");
}

std::string answer_to(const ServedMap& map, const std::string& path, const Values& values) {
  const SurfaceIndex& index = map.asked.index;
  if (path == "/api/query/box") {
    const Eigen::Vector3d a = point_of(values, "min"), b = point_of(values, "max");
    return surfaces_json(index.in(ConvexSpace::box({a.cwiseMin(b), a.cwiseMax(b)})));
  }
  if (path == "/api/query/sphere")
    return surfaces_json(index.in_sphere(point_of(values, "center"), values.number("radius_m")));
  if (path == "/api/query/ray")
    return hit_json(index.first_on_ray(point_of(values, "from"), point_of(values, "direction")));
  if (path == "/api/query/voxel") return voxel_json(map.asked.octree.at(point_of(values, "point")));
  if (path == "/api/query/nearest")
    return found_json(map, index.nearest(point_of(values, "point"), slope_limit(map, values)),
                      "has no such surfaces");
  if (path == "/api/query/below")
    return found_json(map, index.below(point_of(values, "point"), slope_limit(map, values)),
                      "has no such surface below that place");
  if (path == "/api/query/foothold") return foothold_answer(map, values);
  if (path == "/api/changes") return map.changes_json(static_cast<std::uint64_t>(values.number("since")));
  if (path == "/api/regions/all") return all_regions_answer(map, values);
  return region_answer(map, values);
}

}  // namespace

HttpReply Api::answer(const std::string& path, const QueryParameters& given) {
  const std::shared_ptr<const ServedMap> map = map_();
  if (const Json* question = find_question(path)) {
    try {
      const Values values(*question, given);
      if (path == "/api/voxels")
        return {200, "application/octet-stream",
                (values.number("slices") > 0 ? map->slices : map->voxels).get()};
      return reply_of((path == "/api/plan" ? plan(*map, values) : answer_to(*map, path, values)) + "\n");
    } catch (const Error& error) {  // told in the question's words, not the command line's
      if (error.kind() != Error::Kind::usage) throw;
      return refusal(400, error, parameter_of(*question, error.where()));
    }
  }
  if (path == "/") return {200, "text/html; charset=utf-8", map->page.get()};
  if (path == "/api") return reply_of(Json{{"questions", questions()}}.dump(1) + "\n");
  if (path == "/api/info") return {200, "application/json", map->info.get()};
  if (path == "/api/surfaces") return {200, "application/json", map->surfaces.get()};
  return refusal(404, "there is no such page", path.substr(0, 64), "GET /api lists the questions");
}

Follower Api::follower(const QueryParameters& given) const {
  const Values values(*find_question(live_path), given);
  Follower follower;
  if (values.has("since")) follower.known = static_cast<std::uint64_t>(values.number("since"));
  if (values.has("run")) follower.run = values.text("run");
  return follower;
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

std::string Api::plan(const ServedMap& map, const Values& values) {
  PlanQuery query;
  query.from = values.numbers("from");
  query.to = values.numbers("to");
  query.robot = values.text("robot");
  if (values.has("foot")) query.foot = values.text("foot");
  query.budget.expansions = static_cast<std::size_t>(values.number("budget"));
  query.budget.improving = static_cast<std::size_t>(values.number("improving"));
  query.budget.time_s = values.number("time_s");
  const Json& question = *find_question("/api/plan");
  for (const LimitOption& option : limit_options()) {
    const std::string name = parameter_of(question, option.name);
    if (values.has(name)) query.limits.emplace_back(option.name, values.number(name));
  }
  const Robot robot = robot_of(query, map.asked.up);
  const std::string key = Json{map.asked.snapshot->revision, query.robot, query.foot, query.limits}.dump();
  const std::lock_guard lock(planning_);
  if (planned_for_ != key) {
    const GroundRules rules = GroundRules::of(robot, map.asked.octree.resolution());
    const std::shared_ptr<const Snapshot> ground = map.asked.ground(rules).solid();
    std::map<SurfaceId, std::vector<PolygonEdges>> edges;
    if (needs_edge_kinds(robot))
      for (const SurfacePtr& surface : ground->surfaces) edges[surface->id] = map.asked.edges_of(*surface);
    planner_ = std::make_unique<FootstepPlanner>(ground, map.asked.octree, robot, std::move(edges));
    planned_for_ = key;
  }
  return to_json(planner_->plan(standing_of(query.from), standing_of(query.to), query.budget), robot);
}

}  // namespace octosurf
