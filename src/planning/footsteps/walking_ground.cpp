#include "planning/footsteps/walking_ground.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <octosurf/up.hpp>

namespace octosurf::footsteps {
namespace {

constexpr double below_ground = 0.5;  // m of the octree used below the lowest surface
constexpr double stands_within = 2;   // m: search radius for an alternative stance
constexpr double near_height = 0.30;  // m, up or down: search range for ground under a foot

// Lowest and highest point of all surfaces, walking frame.
std::pair<double, double> heights(const Snapshot& snapshot, const Eigen::Quaterniond& R_walk_map) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const SurfacePtr& surface : snapshot.surfaces)
    for (const Polygon& polygon : surface->polygons)
      for (const Eigen::Vector2d& uv : polygon.outer) {
        const double z = (R_walk_map * surface->to_map(uv)).z();
        low = std::min(low, z);
        high = std::max(high, z);
      }
  return low > high ? std::pair(0.0, 0.0) : std::pair(low, high);
}

std::string text(const Eigen::Vector3d& p) {
  char buffer[80];
  std::snprintf(buffer, sizeof buffer, "%.2f %.2f %.2f", p.x(), p.y(), p.z());
  return buffer;
}

std::string text(Ending ending, std::size_t expansions) {
  if (ending == Ending::start_exhausted) return "all that can be reached was looked at";
  if (ending == Ending::goal_cut_off) return "all from which the goal can be reached was looked at";
  return "no plan within " + std::to_string(expansions) + " expansions";
}

std::string why_text(ContactRefusal refusal) {
  switch (refusal) {
    case ContactRefusal::slope:
      return "the ground is too steep there";
    case ContactRefusal::size:
      return "the surface is too small";
    case ContactRefusal::roughness:
      return "the surface is too rough";
    case ContactRefusal::uncertainty:
      return "the surface is not known well enough";
    case ContactRefusal::support:
      return "a part of the sole would have no ground under it";
    case ContactRefusal::margin:
      return "it is too near to an edge";
    case ContactRefusal::frontier:
      return "it is too near to an edge nobody has looked beyond";
    case ContactRefusal::obstacle:
      return "something stands too near to it";
    case ContactRefusal::clearance:
      return "something is over it";
  }
  return {};
}

}  // namespace

WalkingGround::WalkingGround(std::shared_ptr<const Snapshot> the_snapshot, OccupancyView view,
                             std::map<SurfaceId, std::vector<PolygonEdges>> labels, const ContactShape& shape,
                             const ContactLimits& limits, const StepCosts& costs, int headings,
                             double headroom)
    : snapshot(std::move(the_snapshot)),
      octree(std::move(view)),
      edges(std::move(labels)),
      foot(shape),
      contact(limits),
      R_walk_map(upright(limits.up)),
      columns(octree, snapshot, R_walk_map.toRotationMatrix(),
              heights(*snapshot, R_walk_map).first - below_ground,
              heights(*snapshot, R_walk_map).second + headroom),
      field(*snapshot, foot, contact, octree, edges, columns, costs, headings) {}

const std::vector<PolygonEdges>* WalkingGround::edges_of(SurfaceId id) const {
  const auto found = edges.find(id);
  return found == edges.end() ? nullptr : &found->second;
}

Footstep WalkingGround::footstep(FootName name, const Place& place, double yaw_rad) const {
  const Surface& surface = field.surface_of(place);
  const Foothold hold = foothold(surface, foot, R_walk_map.inverse() * place.at, yaw_rad, contact, &octree,
                                 edges_of(surface.id), snapshot.get());
  return {name, surface.id, hold.T_map_contact, yaw_rad, hold.margin_m};
}

Standing WalkingGround::to_map(Standing standing) const {
  standing.at = R_walk_map.inverse() * standing.at;
  return standing;
}

Standing WalkingGround::to_walk(Standing standing) const {
  standing.at = R_walk_map * standing.at;
  return standing;
}

std::pair<std::optional<ContactRefusal>, std::string> WalkingGround::why_not(const Eigen::Vector3d& at,
                                                                             double yaw_rad) const {
  const Eigen::Vector3d up = R_walk_map.inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d wanted = R_walk_map.inverse() * at;
  std::optional<Foothold> best;
  for (const SurfacePtr& surface : snapshot->surfaces) {
    const double lean = surface->plane.normal.dot(up);
    if (lean < 0.1) continue;  // walls, and overhanging surfaces
    const Eigen::Vector3d on = wanted - surface->plane.signed_distance(wanted) / lean * up;
    if ((on - wanted).norm() > near_height) continue;
    const Foothold hold =
        foothold(*surface, foot, on, yaw_rad, contact, &octree, edges_of(surface->id), snapshot.get());
    if (hold.supported > 0 && (!best || hold.supported > best->supported)) best = hold;
  }
  if (!best) return {std::nullopt, "there is no surface under it"};
  if (!best->refused) return {std::nullopt, "the legs or the body would touch something"};
  return {best->refused, why_text(*best->refused)};
}

std::vector<Eigen::Vector3d> WalkingGround::ground_near(const Eigen::Vector3d& at, int heading,
                                                        double radius) {
  const Eigen::Vector2d r(radius, radius);
  std::vector<Eigen::Vector3d> found;
  field.for_each_place(heading, {at.head<2>() - r, at.head<2>() + r}, [&](PlaceId id) {
    if ((field.place(id).at - at).norm() <= radius) found.push_back(field.place(id).at);
  });
  std::stable_sort(found.begin(), found.end(), [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - at).squaredNorm() < (b - at).squaredNorm();
  });
  return found;
}

namespace {

// The foot without a foothold, and the reason.
std::string which_foot(const WalkingGround& ground,
                       const std::vector<std::pair<FootName, Eigen::Vector3d>>& wanted, double yaw_rad,
                       std::optional<ContactRefusal>& contact) {
  for (const auto& [foot, at] : wanted) {
    const auto [refusal, reason] = ground.why_not(at, yaw_rad);
    contact = refusal;
    if (refusal || reason.starts_with("there is no"))
      return "the " + std::string(foot_name(foot)) + " foot at " + text(ground.R_walk_map.inverse() * at) +
             ", where " + reason;
  }
  return "the feet find ground, but one of them, the legs or the body would touch something";
}

}  // namespace

NoPlan refusal_of(WalkingGround& ground, NoPlan::Why why,
                  const std::vector<std::pair<FootName, Eigen::Vector3d>>& wanted, const Standing& at,
                  int heading, const std::function<bool(const Standing&)>& stands) {
  NoPlan result;
  result.why = why;
  result.sentence =
      std::string("it cannot stand at the ") + (why == NoPlan::Why::start ? "start" : "goal") + ": ";
  result.sentence += which_foot(ground, wanted, at.yaw_rad, result.contact);
  for (const Eigen::Vector3d& p : ground.ground_near(at.at, heading, stands_within)) {
    if (!stands({p, at.yaw_rad})) continue;
    result.nearest = ground.R_walk_map.inverse() * p;
    result.nearest_m = (p - at.at).norm();
    char buffer[80];
    std::snprintf(buffer, sizeof buffer, ", %.2f m away", result.nearest_m);
    result.sentence += "; the nearest place to stand is " + text(*result.nearest) + buffer;
    return result;
  }
  char buffer[80];
  std::snprintf(buffer, sizeof buffer, "; there is no place to stand within %.0f m", stands_within);
  result.sentence += buffer;
  return result;
}

NoPlan refusal_of(const WalkingGround& ground, const Frontier& frontier, Ending ending,
                  std::size_t expansions) {
  NoPlan result;
  result.why = ending == Ending::budget ? NoPlan::Why::budget : NoPlan::Why::unreachable;
  result.nearest = ground.R_walk_map.inverse() * frontier.nearest;
  result.nearest_m = frontier.nearest_m;
  result.refused = frontier.refused;
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, "%s; it came within %.2f m of the goal, at %s, where ",
                text(ending, expansions).c_str(), frontier.nearest_m, text(*result.nearest).c_str());
  result.sentence = buffer;
  const auto of = [&](StepRefusal why) { return frontier.refused[static_cast<std::size_t>(why)]; };
  const std::size_t seen = of(StepRefusal::reach) + of(StepRefusal::height) + of(StepRefusal::clearance);
  if (seen == 0) {
    result.sentence += "no foothold nearer to the goal was in sight (support)";
    return result;
  }
  // A reachable place that is too high or blocked is a better reason than one out of reach.
  StepRefusal most = StepRefusal::reach;
  if (of(StepRefusal::height) + of(StepRefusal::clearance) > 0)
    most =
        of(StepRefusal::height) >= of(StepRefusal::clearance) ? StepRefusal::height : StepRefusal::clearance;
  std::snprintf(buffer, sizeof buffer,
                "of %zu footholds nearer to the goal %zu were out of reach, %zu too high or too low, and at "
                "%zu something was in the way (%s)",
                seen, of(StepRefusal::reach), of(StepRefusal::height), of(StepRefusal::clearance),
                std::string(step_refusal_name(most)).c_str());
  result.sentence += buffer;
  return result;
}

}  // namespace octosurf::footsteps
