#include "questions.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <variant>

#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/ground.hpp>

namespace octosurf::services {
namespace {

// The client waits for the answer, and no search may occupy the node indefinitely.
constexpr double usual_plan_s = 30, longest_plan_s = 600;

/// Zero means "any" in requests, where unset numbers are zero.
double or_any(double value) { return value == 0 ? std::numeric_limits<double>::infinity() : value; }

void put(const AskedMap& map, SurfaceId id, const Eigen::Vector3d& point, double distance,
         PlaceAnswer& answer) {
  answer.found = true;
  answer.surfaces = {id};
  answer.point = point;
  answer.distance = distance;
  answer.normal = map.snapshot->find(id)->plane.normal;
}

void ask_place(const AskedMap& map, const PlaceQuestion& question, PlaceAnswer& answer) {
  SlopeLimit limit;
  limit.up = map.up;
  if (question.max_slope != 0) limit.max_slope_rad = question.max_slope;
  const auto place = question.kind == PlaceQuestion::below
                         ? map.index.below(question.point, limit)
                         : map.index.nearest(question.point, limit, or_any(question.distance));
  if (place) put(map, place->id, place->point, place->distance, answer);
}

void ask_ray(const AskedMap& map, const PlaceQuestion& question, PlaceAnswer& answer) {
  const auto hit = map.index.first_on_ray(question.point, question.direction, or_any(question.distance));
  if (!hit) return;
  put(map, hit->id, hit->point, hit->distance, answer);
  answer.front = hit->front;
}

void ask_voxel(const AskedMap& map, const PlaceQuestion& question, PlaceAnswer& answer) {
  if (!question.point.allFinite()) throw Error(Error::Kind::usage, "point", "is not finite");
  const OccupancyView::Voxel voxel = map.snapshot->octree.at(question.point);
  using State = OccupancyView::State;
  answer.state = voxel.state == State::unknown ? PlaceAnswer::unknown
                 : voxel.state == State::free  ? PlaceAnswer::free
                                               : PlaceAnswer::occupied;
  answer.log_odds = voxel.log_odds;
  if (voxel.surface != 0) answer.surfaces = {voxel.surface};
}

const Surface& surface_of(const AskedMap& map, SurfaceId id) {
  const Surface* const surface = map.snapshot->find(id);
  if (surface == nullptr)
    throw Error(Error::Kind::data, "surface", "there is none of id " + std::to_string(id));
  return *surface;
}

void ask_ground(const AskedMap& map, const PlaceQuestion& question, PlaceAnswer& answer) {
  SurfaceId id = question.surface;
  if (id == 0) {
    const auto nearest = map.index.nearest(question.point);
    if (!nearest) return;
    id = nearest->id;
  }
  const Surface& surface = surface_of(map, id);
  if (!question.point.allFinite()) throw Error(Error::Kind::usage, "point", "is not finite");
  const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * question.point).head<2>();
  const Eigen::Vector3d at = surface.to_map(uv);
  put(map, id, at, (question.point - at).norm(), answer);
  const OccupancyView& octree = map.snapshot->octree;
  answer.ground = ground_name(ground_at(*find_gaps(surface, octree, 0).surface, octree, uv));
}

ContactShape foot_of(const RegionsQuestion& question) {
  const bool is_sole = question.length != 0 || question.width != 0;
  if (is_sole == (question.radius != 0))
    throw Error(Error::Kind::usage, "length, width, radius", "say no foot, or two",
                "give length and width, or a radius");
  return is_sole ? ContactShape::rectangle(question.length, question.width)
                 : ContactShape::disc(question.radius);
}

/// Fields of 0 stand for a biped's.
GroundRules rules_of(const RegionsQuestion& question, const AskedMap& map) {
  GroundRules rules = GroundRules::of(Biped{}, map.snapshot->resolution);
  rules.foot = foot_of(question);
  ContactLimits& limits = rules.limits;
  limits.up = map.up;
  if (question.max_slope != 0) limits.max_slope_rad = question.max_slope;
  if (question.edge_margin != 0) limits.edge_margin_m = question.edge_margin;
  if (question.obstacle_margin != 0) limits.obstacle_margin_m = question.obstacle_margin;
  if (question.clearance != 0) limits.clearance_m = question.clearance;
  return rules;
}

Robot robot_of(const std::string& name, const Eigen::Vector3d& up) {
  if (!name.empty() && name != "biped" && name != "quadruped")
    throw Error(Error::Kind::usage, "robot", "is neither biped nor quadruped: " + name.substr(0, 40));
  Robot robot = name == "quadruped" ? Robot(Quadruped{}) : Robot(Biped{});
  std::visit([&](auto& kind) { kind.contact.up = up; }, robot);
  return robot;
}

}  // namespace

PlaceAnswer answer(const AskedMap& map, const PlaceQuestion& question) {
  PlaceAnswer answer;
  switch (question.kind) {
    case PlaceQuestion::nearest:
    case PlaceQuestion::below:
      ask_place(map, question, answer);
      break;
    case PlaceQuestion::ray:
      ask_ray(map, question, answer);
      break;
    case PlaceQuestion::sphere:
      answer.surfaces = map.index.in_sphere(question.point, question.distance);
      break;
    case PlaceQuestion::box: {
      Eigen::AlignedBox3d box(question.point);
      box.extend(question.corner);
      answer.surfaces = map.index.in(ConvexSpace::box(box));
      break;
    }
    case PlaceQuestion::voxel:
      ask_voxel(map, question, answer);
      break;
    case PlaceQuestion::ground:
      ask_ground(map, question, answer);
      break;
    default:
      throw Error(Error::Kind::usage, "kind", "is none of octosurf_msgs/Query");
  }
  return answer;
}

std::vector<FoundRegion> answer(const AskedMap& map, const RegionsQuestion& question) {
  std::optional<double> yaw;
  if (!question.any_heading) yaw = question.yaw;
  if (question.surface != 0) surface_of(map, question.surface);
  const GroundView ground(map.snapshot, map.snapshot->octree, rules_of(question, map));
  std::vector<FoundRegion> found;
  for (const SurfacePtr& surface : map.snapshot->surfaces) {
    if (question.surface != 0 && surface->id != question.surface) continue;
    ContactRegion region = ground.region(surface->id, yaw);
    std::vector<ConvexPiece> pieces;
    if (question.pieces > 0) pieces = convex_pieces(*surface, region, question.pieces);
    found.push_back({surface.get(), std::move(region), std::move(pieces)});
  }
  return found;
}

FootstepPlan answer(const AskedMap& map, const PlanQuestion& question) {
  PlanBudget budget;
  if (question.expansions != 0) budget.expansions = question.expansions;
  budget.time_s = question.time_limit == 0 ? usual_plan_s : std::min(question.time_limit, longest_plan_s);
  const Robot robot = robot_of(question.robot, map.up);
  const OccupancyView& octree = map.snapshot->octree;
  const GroundView ground(map.snapshot, octree, GroundRules::of(robot, map.snapshot->resolution));
  FootstepPlanner planner(ground.solid(), octree, robot);
  return planner.plan(question.start, question.goal, budget);
}

std::string kept_line(const std::string& stem, const Snapshot& snapshot, const std::string& what) {
  return stem + ": " + std::to_string(snapshot.surfaces.size()) + " surfaces of revision " +
         std::to_string(snapshot.revision) + " " + what;
}

}  // namespace octosurf::services
