#include "answers.hpp"

#include "surface_messages.hpp"

#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf::ros1 {
namespace {

template <class Message>
Eigen::Vector3d vector_of(const Message& message) {
  return {message.x, message.y, message.z};
}

/// Zero stands for "any" in requests, whose numbers are zero where nobody sets them.
double or_any(double value) { return value == 0 ? std::numeric_limits<double>::infinity() : value; }

/// A response that `fill` fills in, or that says why it cannot.
template <class Response, class Fill>
Response answered(const AskedMap& map, const Fill& fill) {
  Response response;
  response.success = true;
  response.revision = map.snapshot->revision;
  try {
    fill(response);
  } catch (const Error& error) {
    response = Response();
    response.success = false;
    response.message = error.what();
    response.revision = map.snapshot->revision;
  }
  return response;
}

// ---- places ----

using Query = octosurf_msgs::Query;

void put(const AskedMap& map, SurfaceId id, const Eigen::Vector3d& point, double distance,
         Query::Response& response) {
  response.found = true;
  response.surfaces = {id};
  response.point = point_message(point);
  response.distance = distance;
  response.normal = vector_message(map.snapshot->find(id)->plane.normal);
}

void ask_place(const AskedMap& map, const Query::Request& request, Query::Response& response) {
  SlopeLimit limit;
  if (request.max_slope != 0) limit.max_slope_rad = request.max_slope;
  const Eigen::Vector3d point = vector_of(request.point);
  const auto place = request.kind == Query::Request::BELOW
                         ? map.index.below(point, limit)
                         : map.index.nearest(point, limit, or_any(request.distance));
  if (place) put(map, place->id, place->point, place->distance, response);
}

void ask_ray(const AskedMap& map, const Query::Request& request, Query::Response& response) {
  const auto hit = map.index.first_on_ray(vector_of(request.point), vector_of(request.direction),
                                          or_any(request.distance));
  if (!hit) return;
  put(map, hit->id, hit->point, hit->distance, response);
  response.front = hit->front;
}

void ask_box(const AskedMap& map, const Query::Request& request, Query::Response& response) {
  Eigen::AlignedBox3d box(vector_of(request.point));
  box.extend(vector_of(request.corner));
  response.surfaces = map.index.in(ConvexSpace::box(box));
}

void ask_voxel(const AskedMap& map, const Query::Request& request, Query::Response& response) {
  const Eigen::Vector3d point = vector_of(request.point);
  if (!point.allFinite()) throw Error(Error::Kind::usage, "point", "is not finite");
  const OccupancyView::Voxel voxel = map.snapshot->octree.at(point);
  using State = OccupancyView::State;
  response.state = voxel.state == State::unknown ? Query::Response::UNKNOWN
                   : voxel.state == State::free  ? Query::Response::FREE
                                                 : Query::Response::OCCUPIED;
  response.log_odds = voxel.log_odds;
  if (voxel.surface != 0) response.surfaces = {voxel.surface};
}

void ask(const AskedMap& map, const Query::Request& request, Query::Response& response) {
  switch (request.kind) {
    case Query::Request::NEAREST:
    case Query::Request::BELOW:
      return ask_place(map, request, response);
    case Query::Request::RAY:
      return ask_ray(map, request, response);
    case Query::Request::SPHERE:
      response.surfaces = map.index.in_sphere(vector_of(request.point), request.distance);
      return;
    case Query::Request::BOX:
      return ask_box(map, request, response);
    case Query::Request::VOXEL:
      return ask_voxel(map, request, response);
    default:
      throw Error(Error::Kind::usage, "kind", "is none of octosurf_msgs/Query");
  }
}

// ---- contact regions ----

using Regions = octosurf_msgs::ContactRegions;

ContactShape foot_of(const Regions::Request& request) {
  const bool is_sole = request.length != 0 || request.width != 0;
  if (is_sole == (request.radius != 0))
    throw Error(Error::Kind::usage, "length, width, radius", "say no foot, or two",
                "give length and width, or a radius");
  return is_sole ? ContactShape::rectangle(request.length, request.width)
                 : ContactShape::disc(request.radius);
}

ContactLimits limits_of(const Regions::Request& request) {
  ContactLimits limits;
  if (request.max_slope != 0) limits.max_slope_rad = request.max_slope;
  limits.edge_margin_m = request.edge_margin;
  limits.obstacle_margin_m = request.obstacle_margin;
  limits.clearance_m = request.clearance;
  limits.gap_depth_m = request.gap_depth;
  return limits;
}

octosurf_msgs::ContactRegion region_message(const Surface& surface, const ContactRegion& region,
                                            std::size_t pieces) {
  octosurf_msgs::ContactRegion message;
  message.surface = surface.id;
  message.revision = region.revision;
  message.area = region.area_m2;
  for (const Polygon& polygon : region.polygons)
    message.polygons.push_back(polygon_message(polygon, surface));
  for (const ContactRefusal refusal : region.refused)
    message.refused.emplace_back(contact_refusal_name(refusal));
  if (pieces > 0)
    for (const ConvexPiece& piece : convex_pieces(surface, region, pieces))
      message.pieces.push_back(ring_message(piece.vertices));
  return message;
}

// ---- plans ----

using Plan = octosurf_msgs::Plan;

Robot robot_of(const std::string& name) {
  if (name.empty() || name == "biped") return Biped{};
  if (name == "quadruped") return Quadruped{};
  throw Error(Error::Kind::usage, "robot", "is neither biped nor quadruped: " + name.substr(0, 40));
}

octosurf_msgs::Footstep footstep_message(const Footstep& step) {
  octosurf_msgs::Footstep message;
  message.foot = foot_name(step.foot);
  message.surface = step.surface;
  message.pose = pose_message(step.T_map_foot);
  message.yaw = step.yaw_rad;
  message.margin = step.margin_m;
  return message;
}

}  // namespace

Query::Response answer(const AskedMap& map, const Query::Request& request) {
  return answered<Query::Response>(map, [&](Query::Response& response) { ask(map, request, response); });
}

Regions::Response answer(const AskedMap& map, const Regions::Request& request) {
  return answered<Regions::Response>(map, [&](Regions::Response& response) {
    const ContactShape foot = foot_of(request);
    const ContactLimits limits = limits_of(request);
    std::optional<double> yaw;
    if (!request.any_heading) yaw = request.yaw;
    const Snapshot& snapshot = *map.snapshot;
    if (request.surface != 0 && snapshot.find(request.surface) == nullptr)
      throw Error(Error::Kind::data, "surface", "there is none of id " + std::to_string(request.surface));
    for (const SurfacePtr& surface : snapshot.surfaces) {
      if (request.surface != 0 && surface->id != request.surface) continue;
      const ContactRegion region = contact_region(*surface, foot, yaw, limits, &snapshot.octree);
      response.regions.push_back(region_message(*surface, region, request.pieces));
    }
  });
}

Plan::Response answer(const AskedMap& map, const Plan::Request& request) {
  return answered<Plan::Response>(map, [&](Plan::Response& response) {
    PlanBudget budget;
    if (request.expansions != 0) budget.expansions = request.expansions;
    if (request.time_limit != 0) budget.time_s = request.time_limit;
    FootstepPlanner planner(map.snapshot, map.snapshot->octree, robot_of(request.robot));
    const FootstepPlan plan = planner.plan({vector_of(request.start), request.start_yaw},
                                           {vector_of(request.goal), request.goal_yaw}, budget);
    response.found = plan.found();
    for (const Footstep& step : plan.start) response.start.push_back(footstep_message(step));
    for (const Footstep& step : plan.steps) response.steps.push_back(footstep_message(step));
    response.cost = plan.cost;
    response.lower_bound = plan.lower_bound;
    response.expansions = static_cast<std::uint32_t>(plan.expansions);
    if (plan.refusal) response.message = plan.refusal->sentence;
  });
}

}  // namespace octosurf::ros1
