#include "answers.hpp"

#include "surface_messages.hpp"

#include <octosurf/error.hpp>

namespace octosurf::ros1 {
namespace {

using octosurf_msgs::Query;
using services::PlaceAnswer;
using services::PlaceQuestion;
static_assert(int{PlaceQuestion::nearest} == Query::Request::NEAREST &&
              int{PlaceQuestion::below} == Query::Request::BELOW &&
              int{PlaceQuestion::ray} == Query::Request::RAY &&
              int{PlaceQuestion::sphere} == Query::Request::SPHERE &&
              int{PlaceQuestion::box} == Query::Request::BOX &&
              int{PlaceQuestion::voxel} == Query::Request::VOXEL);
static_assert(int{PlaceAnswer::unknown} == Query::Response::UNKNOWN &&
              int{PlaceAnswer::free} == Query::Response::FREE &&
              int{PlaceAnswer::occupied} == Query::Response::OCCUPIED);

template <class Message>
Eigen::Vector3d vector_of(const Message& message) {
  return {message.x, message.y, message.z};
}

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

octosurf_msgs::ContactRegion region_message(const services::FoundRegion& found) {
  octosurf_msgs::ContactRegion message;
  message.surface = found.surface->id;
  message.revision = found.region.revision;
  message.area = found.region.area_m2;
  for (const Polygon& polygon : found.region.polygons)
    message.polygons.push_back(polygon_message(polygon, *found.surface));
  for (const ConvexPiece& piece : found.pieces) message.pieces.push_back(ring_message(piece.vertices));
  for (const ContactRefusal refusal : found.region.refused)
    message.refused.emplace_back(contact_refusal_name(refusal));
  return message;
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
  return answered<Query::Response>(map, [&](Query::Response& response) {
    const PlaceAnswer found = services::answer(
        map, PlaceQuestion{request.kind, vector_of(request.point), vector_of(request.corner),
                           vector_of(request.direction), request.distance, request.max_slope});
    response.found = found.found;
    response.surfaces = found.surfaces;
    response.point = point_message(found.point);
    response.distance = found.distance;
    response.normal = vector_message(found.normal);
    response.front = found.front;
    response.state = found.state;
    response.log_odds = found.log_odds;
  });
}

octosurf_msgs::ContactRegions::Response answer(const AskedMap& map,
                                               const octosurf_msgs::ContactRegions::Request& request) {
  using Response = octosurf_msgs::ContactRegions::Response;
  return answered<Response>(map, [&](Response& response) {
    services::RegionsQuestion question;
    question.surface = request.surface;
    question.length = request.length;
    question.width = request.width;
    question.radius = request.radius;
    question.any_heading = request.any_heading;
    question.yaw = request.yaw;
    question.max_slope = request.max_slope;
    question.edge_margin = request.edge_margin;
    question.obstacle_margin = request.obstacle_margin;
    question.clearance = request.clearance;
    question.gap_depth = request.gap_depth;
    question.pieces = request.pieces;
    for (const services::FoundRegion& found : services::answer(map, question))
      response.regions.push_back(region_message(found));
  });
}

octosurf_msgs::Plan::Response answer(const AskedMap& map, const octosurf_msgs::Plan::Request& request) {
  using Response = octosurf_msgs::Plan::Response;
  return answered<Response>(map, [&](Response& response) {
    const FootstepPlan plan =
        services::answer(map, services::PlanQuestion{request.robot,
                                                     {vector_of(request.start), request.start_yaw},
                                                     {vector_of(request.goal), request.goal_yaw},
                                                     request.expansions,
                                                     request.time_limit});
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
