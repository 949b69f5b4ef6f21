// Footholds and contact regions of `octosurf query`.
#include "contact_query.hpp"

#include "answers.hpp"
#include "bounds.hpp"
#include "geometry/degrees.hpp"
#include "plan_query.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include <octosurf/boundary.hpp>
#include <octosurf/contact.hpp>
#include <octosurf/error.hpp>
#include <octosurf/gaps.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

/// Edge kinds take some ms, and are needed for a frontier margin only.
std::vector<PolygonEdges> asked_edges_of(const AskedMap& map, const GroundView& ground, SurfaceId id) {
  return ground.rules().limits.frontier_margin_m > 0 ? map.edges_of(*ground.solid(id))
                                                     : std::vector<PolygonEdges>{};
}

void print(const FoundFoothold& answer) {
  const Foothold& found = answer.foothold;
  const Eigen::Vector3d at = found.T_map_contact.translation(), normal = found.T_map_contact.linear().col(2);
  const std::string refused = found.refused ? std::string(contact_refusal_name(*found.refused)) : "";
  std::printf("surface    %u\n", found.surface);
  std::printf("accepted   %s\n", found.accepted ? "yes" : ("no: " + refused).c_str());
  std::printf("supported  %.1f %%\n", 100 * found.supported);
  const bool all = answer.ground[static_cast<std::size_t>(Ground::supported)] >= 1;
  if (!all) std::printf("ground    ");
  for (std::size_t k = 0; k < ground_names.size(); ++k)
    if (!all && answer.ground[k] > 0)
      std::printf(" %.0f %% %s", 100 * answer.ground[k], ground_names[k].data());
  if (!all) std::printf("\n");
  std::printf("margin     %.4f m\n", found.margin_m);
  std::printf("point      %.4f %.4f %.4f\n", at.x(), at.y(), at.z());
  std::printf("normal     %.4f %.4f %.4f\n", normal.x(), normal.y(), normal.z());
}

void print(const FoundRegion& found) {
  const auto& [surface, region, pieces] = found;
  std::size_t holes = 0;
  for (const Polygon& polygon : region.polygons) holes += polygon.holes.size();
  std::printf("surface  %u, %.3f m²\n", surface->id, surface->area_m2);
  std::printf("region   %.3f m² in %zu parts with %zu holes\n", region.area_m2, region.polygons.size(),
              holes);
  for (const ContactRefusal refusal : region.refused)
    std::printf("refused  %s\n", contact_refusal_name(refusal).data());
  for (const ConvexPiece& piece : pieces) std::printf("piece    of %zu corners\n", piece.vertices.size());
}

}  // namespace

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

void add_contact_options(CLI::App& verb, CLI::Option_group& question, ContactQuery& query) {
  question
      .add_option("--foothold", query.foothold,
                  "X Y Z YAW: whether a --foot at this heading (degrees) is supported on the surface nearest "
                  "to this point, or why not")
      ->expected(4);
  question.add_option(
      "--regions", query.regions,
      "ID: where on this surface the middle of a --foot may be for all of it to be supported");
  verb.add_option("--robot", query.robot, "biped or quadruped: whose foot and limits hold")
      ->check(CLI::IsMember({"biped", "quadruped"}))
      ->capture_default_str();
  verb.add_option("--foot", query.foot, "LENGTHxWIDTH of a sole, or the radius of a disc, m [the robot's]");
  verb.add_option("--yaw", query.yaw_deg, "heading for --regions, degrees [any heading]");
  verb.add_option("--pieces", query.pieces, "also print the region as at most N convex pieces");
  const auto metres = [&verb](const char* name, std::optional<double>& value, const char* help) {
    verb.add_option(name, value, help)->check(at_least(0));
  };
  metres("--edge-margin", query.edge_margin, "m: from the foot to every edge [the map's resolution]");
  metres("--frontier-margin", query.frontier_margin,
         "m: from the foot to edges beyond which nothing was observed [0]");
  metres("--obstacle-margin", query.obstacle_margin,
         "m: from the foot to obstacles up to --clearance [the map's resolution]");
  metres("--clearance", query.clearance,
         "m: height over the foot that must be clear; 0: not checked [the robot's height]");
  verb.add_option("--unseen", query.unseen_share,
                  "widest unseen gap that a foot may span, as a share of its narrower side")
      ->check(between(0, 1))
      ->capture_default_str();
  verb.add_flag("--as-mapped", query.as_mapped,
                "outlines of the readings, which are no ground: without margins, clearance and voids");
}

AskedMap::AskedMap(std::string of, std::shared_ptr<const Snapshot> map, OccupancyView view,
                   const Eigen::Vector3d& upward,
                   std::function<std::vector<PolygonEdges>(const Surface&)> label)
    : name(std::move(of)),
      snapshot(std::move(map)),
      octree(std::move(view)),
      up(upward),
      edges_of(std::move(label)),
      ground(snapshot, octree, rules_of({}, up, octree.resolution())) {}

GroundRules rules_of(const ContactQuery& query, const Eigen::Vector3d& up, double resolution) {
  PlanQuery plan;
  plan.robot = query.robot;
  plan.foot = query.foot;
  GroundRules rules = GroundRules::of(robot_of(plan, up), resolution);
  rules.widest_unseen_m = widest_unseen_of(rules.foot, query.unseen_share);
  rules.as_mapped = query.as_mapped;
  ContactLimits& limits = rules.limits;
  if (query.as_mapped) limits = {.up = up, .max_slope_rad = limits.max_slope_rad};
  limits.max_slope_rad = query.max_slope_deg ? *query.max_slope_deg * rad_per_deg : limits.max_slope_rad;
  limits.edge_margin_m = query.edge_margin.value_or(limits.edge_margin_m);
  limits.frontier_margin_m = query.frontier_margin.value_or(limits.frontier_margin_m);
  limits.clearance_m = query.clearance.value_or(limits.clearance_m);
  limits.obstacle_margin_m =
      query.obstacle_margin.value_or(limits.clearance_m > 0 ? limits.obstacle_margin_m : 0);
  return rules;
}

FoundRegion find_region(const AskedMap& map, const ContactQuery& query) {
  const GroundView ground = map.ground.by(rules_of(query, map.up, map.octree.resolution()));
  const SurfaceId id = query.regions.value();
  if (map.snapshot->find(id) == nullptr)
    throw Error(Error::Kind::data, map.name, "has no surface " + std::to_string(id),
                "octosurf info lists them");
  std::optional<double> yaw;
  if (query.yaw_deg) yaw = *query.yaw_deg * rad_per_deg;
  const std::vector<PolygonEdges> edges = asked_edges_of(map, ground, id);
  const SurfacePtr surface = ground.solid(id);
  const ContactRegion region = ground.region(id, yaw, &edges);
  return {surface, region, convex_pieces(*surface, region, query.pieces)};
}

FoundFoothold find_foothold(const AskedMap& map, const ContactQuery& query) {
  const GroundView ground = map.ground.by(rules_of(query, map.up, map.octree.resolution()));
  const std::vector<double>& v = query.foothold;
  const Eigen::Vector3d at(v[0], v[1], v[2]);
  const auto found = nearest(*map.snapshot, at);
  if (!found) throw Error(Error::Kind::data, map.name, "has no surfaces", "map more scans first");
  const std::vector<PolygonEdges> edges = asked_edges_of(map, ground, found->id);
  const Foothold stood = ground.foothold(found->id, at, v[3] * rad_per_deg, &edges);
  return {stood,
          ground_under(*ground.solid(found->id), map.octree, ground.rules().foot, stood.T_map_contact)};
}

void answer(const AskedMap& map, const ContactQuery& query, bool json) {
  if (query.regions) {
    const FoundRegion found = find_region(map, query);
    if (!json) return print(found);
    std::printf("%s\n", region_json(*found.surface, found.region, found.pieces).c_str());
  } else {
    const FoundFoothold found = find_foothold(map, query);
    if (!json) return print(found);
    std::printf("%s\n", foothold_json(found.foothold, found.ground).c_str());
  }
}

}  // namespace octosurf
