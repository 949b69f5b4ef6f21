#include "planning/questions.hpp"

#include <charconv>
#include <variant>

#include <octosurf/error.hpp>

namespace octosurf::planning {
namespace {

/// What a foot lowered there meets within half a step above or below: if possible a surface that it may stand
/// on, not a riser in front of it. Beside all outlines, the nearest such surface within half a step.
SurfaceId surface_for_foot(const AskedMap& map, const Eigen::Vector3d& at, double half_step,
                           double max_slope_rad) {
  const SlopeLimit standable{map.up, max_slope_rad}, any{map.up};
  const Eigen::Vector3d lifted = at + half_step * map.up.normalized();
  for (const SlopeLimit& limit : {standable, any})
    if (const auto place = map.index.below(lifted, limit); place && place->distance <= 2 * half_step)
      return place->id;
  if (const auto place = map.index.nearest(at, standable, half_step)) return place->id;
  const auto nearest = map.index.nearest(at), below = map.index.below(at, any);
  if (!nearest) throw Error(Error::Kind::data, map.name, "has no surfaces", "map more scans first");
  const auto named = [](const Nearest& place, const char* where) {
    const std::string metres = std::to_string(place.distance);
    return "surface " + std::to_string(place.id) + " is " + metres.substr(0, metres.find('.') + 3) + " m " +
           where;
  };
  throw Error(Error::Kind::data, map.name,
              "no surface is within half a step of that place: " +
                  (below ? named(*below, "below it") : named(*nearest, "off, and nothing below it")),
              "query --below has the ground's height");
}

}  // namespace

AskedMap::AskedMap(std::string of, std::shared_ptr<const Snapshot> now, OccupancyView view,
                   const Eigen::Vector3d& upward)
    : name(std::move(of)), snapshot(std::move(now)), octree(std::move(view)), up(upward), index(snapshot) {}

GroundView AskedMap::ground(GroundRules rules) const {
  const double widest = rules.widest_unseen_m.value_or(widest_unseen_of(rules.foot));
  rules.widest_unseen_m = widest < 2 * octree.resolution() ? 0 : widest;
  return {snapshot, octree, rules};
}

GroundView AskedMap::bare_ground() const {
  GroundRules rules = GroundRules::of(Biped{}, octree.resolution());
  rules.limits.up = up;
  rules.widest_unseen_m = 0;
  return ground(rules);
}

const Surface& AskedMap::surface(SurfaceId id) const {
  if (const Surface* found = snapshot->find(id)) return *found;
  throw Error(Error::Kind::data, name, "has no surface " + std::to_string(id), "octosurf info lists them");
}

ContactShape foot_of(const std::string& text) {
  const char *begin = text.data(), *end = begin + text.size();
  double length = 0, width = 0;
  const auto [times, bad_length] = std::from_chars(begin, end, length);
  if (bad_length == std::errc() && times == end) return ContactShape::disc(length);
  if (bad_length == std::errc() && *times == 'x') {
    const auto [rest, bad_width] = std::from_chars(times + 1, end, width);
    if (bad_width == std::errc() && rest == end) return ContactShape::rectangle(length, width);
  }
  throw Error(Error::Kind::usage, "--foot " + text, "is no foot",
              "write LENGTHxWIDTH of a sole, such as 0.22x0.11, or the radius of a disc, in metres");
}

GroundRules rules_of(const ContactQuestion& question, const Eigen::Vector3d& up, double resolution) {
  GroundRules rules = GroundRules::of(question.robot, resolution);
  if (question.foot) rules.foot = *question.foot;
  rules.widest_unseen_m = widest_unseen_of(rules.foot, question.unseen_share);
  rules.as_mapped = question.as_mapped;
  ContactLimits& limits = rules.limits;
  if (question.as_mapped) limits = {.max_slope_rad = limits.max_slope_rad};
  limits.up = up;
  limits.max_slope_rad = question.max_slope_rad.value_or(limits.max_slope_rad);
  limits.edge_margin_m = question.edge_margin_m.value_or(limits.edge_margin_m);
  limits.clearance_m = question.clearance_m.value_or(limits.clearance_m);
  if (question.unknown_is_free || limits.clearance_m <= 0) limits.unknown_to_m = 0;
  limits.obstacle_margin_m =
      question.obstacle_margin_m.value_or(limits.clearance_m > 0 ? limits.obstacle_margin_m : 0);
  return rules;
}

FoundRegion find_region(const AskedMap& map, const ContactQuestion& question) {
  const GroundView ground = map.ground(rules_of(question, map.up, map.octree.resolution()));
  const SurfaceId id = map.surface(question.surface).id;
  FoundRegion found;
  if (question.at) {
    // Not its outline, but the same frame.
    found.surface = std::shared_ptr<const Surface>(map.snapshot, &map.surface(id));
    found.region = ground.region_about(id, *question.at, question.reach_m, question.yaw_rad);
  } else {
    found.surface = ground.solid(id);
    found.region = ground.region(id, question.yaw_rad);
  }
  found.pieces = convex_pieces(*found.surface, found.region.polygons, question.pieces);
  return found;
}

FoundFoothold find_foothold(const AskedMap& map, const ContactQuestion& question) {
  const GroundRules rules = rules_of(question, map.up, map.octree.resolution());
  const Eigen::Vector3d& at = question.at.value();
  const double half_step = std::visit([](const auto& robot) { return robot.max_up_m / 2; }, question.robot);
  const SurfaceId id = surface_for_foot(map, at, half_step, rules.limits.max_slope_rad);
  const GroundView ground = map.ground(rules);
  FoundFoothold found;
  found.foothold = ground.foothold(id, at, question.yaw_rad.value_or(0));
  found.off_m = map.up.normalized().dot(at - found.foothold.T_map_contact.translation());
  if (found.foothold.accepted) {
    found.ground[static_cast<std::size_t>(Ground::supported)] = 1;
    return found;
  }
  found.ground = ground.ground_under(id, found.foothold.T_map_contact);
  return found;
}

}  // namespace octosurf::planning
