#include "questions.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/stairs_json.hpp"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/error.hpp>
#include <octosurf/ground_patch.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using Fields = QuestionFields;

constexpr std::array<const char*, 3> state_names{"unknown", "free", "occupied"};  // by State

// Places.

Fields point_fields(Request& asked) { return {point_field("point", "m", asked.point).needed()}; }

Fields slope_fields(Request& asked) {
  Fields fields = point_fields(asked);
  fields.push_back(number_field("max_slope_deg",
                                "only surfaces that slope so much at most; 90 leaves out ceilings",
                                asked.contact.max_slope_rad, 0, 180, rad_per_deg)
                       .by_default("180"));
  return fields;
}

SlopeLimit limit_of(const planning::AskedMap& map, const Request& asked) {
  return {map.up, asked.contact.max_slope_rad.value_or(std::numbers::pi)};
}

Json place_json(const planning::AskedMap& map, const std::optional<Nearest>& place, const char* none) {
  if (!place)
    throw Error(Error::Kind::data, map.name, none,
                "map more scans first, or allow a greater slope (--max-slope)");
  const Surface& surface = map.surface(place->id);
  return Json{{"surface", place->id},
              {"point", place->point},
              {"distance_m", place->distance},
              {"normal", surface.plane.normal},
              {"slope_deg", slope_rad(surface, map.up) * deg_per_rad},
              {"area_m2", surface.area_m2}};
}

Json nearest_json(const planning::AskedMap& map, const Request& asked) {
  return place_json(map, map.index.nearest(asked.point, limit_of(map, asked)), "has no such surfaces");
}

Json below_json(const planning::AskedMap& map, const Request& asked) {
  return place_json(map, map.index.below(asked.point, limit_of(map, asked)),
                    "has no such surface below that place");
}

Fields box_fields(Request& asked) {
  return {point_field("min", "a corner, m", asked.point).needed(),
          point_field("max", "the opposite one, m", asked.corner).needed()};
}

Json box_json(const planning::AskedMap& map, const Request& asked) {
  Eigen::AlignedBox3d box(asked.point);
  box.extend(asked.corner);
  return Json{{"surfaces", map.index.in(ConvexSpace::box(box))}};
}

Fields sphere_fields(Request& asked) {
  return {point_field("center", "m", asked.point).needed(),
          number_field("radius_m", "m", asked.radius_m, 0, farthest_m).needed()};
}

Json sphere_json(const planning::AskedMap& map, const Request& asked) {
  return Json{{"surfaces", map.index.in_sphere(asked.point, asked.radius_m)}};
}

Fields ray_fields(Request& asked) {
  return {point_field("from", "where it begins, m", asked.point).needed(),
          point_field("direction", "of any length", asked.direction).needed()};
}

/// A ray may meet nothing.
Json ray_json(const planning::AskedMap& map, const Request& asked) {
  const auto hit = map.index.first_on_ray(asked.point, asked.direction);
  if (!hit) return Json{{"surface", nullptr}};
  return Json{{"surface", hit->id},
              {"point", hit->point},
              {"distance_m", hit->distance},
              {"side", hit->front ? "front" : "back"}};
}

Json voxel_json(const planning::AskedMap& map, const Request& asked) {
  const OccupancyView::Voxel voxel = map.octree.at(asked.point);
  const bool known = voxel.state != OccupancyView::State::unknown;
  return Json{{"state", state_names.at(static_cast<std::size_t>(voxel.state))},
              {"log_odds", known ? Json(voxel.log_odds) : Json()},
              {"surface", voxel.surface != 0 ? Json(voxel.surface) : Json()}};
}

// Footholds and contact regions.

Fields foothold_fields(Request& asked) {
  Fields fields = contact_fields(asked.contact);
  fields.push_back(point_field("point", "m", asked.contact.at).needed());
  fields.push_back(
      number_field("yaw_deg", "heading, degrees", asked.contact.yaw_rad, -3600, 3600, rad_per_deg).needed());
  return fields;
}

Json foothold_json(const planning::AskedMap& map, const Request& asked) {
  const planning::FoundFoothold answer = planning::find_foothold(map, asked.contact);
  const Foothold& found = answer.foothold;
  Json shares;
  for (std::size_t k = 0; k < answer.ground.size(); ++k)
    shares[std::string(ground_names[k])] = answer.ground[k];
  return {{"surface", found.surface},
          {"accepted", found.accepted},
          {"refused", found.refused ? Json(contact_refusal_name(*found.refused)) : Json()},
          {"supported", found.supported},
          {"ground", shares},
          {"margin_m", found.margin_m},
          {"off_m", answer.off_m},
          {"point", Eigen::Vector3d(found.T_map_contact.translation())},
          {"normal", Eigen::Vector3d(found.T_map_contact.linear().col(2))},
          {"heading", Eigen::Vector3d(found.T_map_contact.linear().col(0))}};
}

Fields one_region_fields(Request& asked) {
  Fields fields = region_fields(asked.contact);
  fields.push_back(number_field("surface", "its id", asked.contact.surface, 1, double{last_id}).needed());
  return fields;
}

Json ring_json(const Surface& surface, const Ring2& ring) {
  Json points = Json::array();
  for (const Eigen::Vector2d& uv : ring) points.push_back(surface.to_map(uv));
  return points;
}

Json region_json(const planning::AskedMap& map, const Request& asked) {
  const auto& [surface, region, pieces] = planning::find_region(map, asked.contact);
  Json json{{"surface", region.surface}, {"revision", region.revision}};
  // Divided, not multiplied by the inverse: most headings that were given in degrees come back to the digit.
  json["yaw_deg"] = region.yaw_rad ? Json(*region.yaw_rad / rad_per_deg) : Json();
  json["area_m2"] = region.area_m2;
  json["refused"] = Json::array();
  for (const ContactRefusal refusal : region.refused)
    json["refused"].push_back(contact_refusal_name(refusal));
  json["polygons"] = Json::array();
  for (const Polygon& polygon : region.polygons) {
    Json holes = Json::array();
    for (const Ring2& hole : polygon.holes) holes.push_back(ring_json(*surface, hole));
    json["polygons"].push_back({{"outer", ring_json(*surface, polygon.outer)}, {"holes", holes}});
  }
  json["pieces"] = Json::array();
  for (const ConvexPiece& piece : pieces) json["pieces"].push_back(piece.vertices);
  return json;
}

// Stairs and patches.

constexpr double anywhere_m = std::numeric_limits<double>::infinity();

Fields stair_fields(Request& asked) { return {point_field("point", "m", asked.point, anywhere_m).needed()}; }

Stair find_stair(const planning::AskedMap& map, const Request& asked) {
  const GroundView ground = map.bare_ground();
  if (const Stair* stair = nearest_stair(*map.snapshot, ground.stairs().stairs, asked.point)) return *stair;
  throw Error(Error::Kind::data, map.name, "has no stair", "map more of it first");
}

Fields patch_fields(Request& asked) { return {standing_field("base", "of a robot", asked.base, anywhere_m)}; }

GroundPatch find_patch(const planning::AskedMap& map, const Standing& base) {
  GroundRules rules = GroundRules::of(Biped{}, map.octree.resolution());
  rules.limits.up = map.up;
  Eigen::Isometry3d T_map_base(upright(map.up).inverse() *
                               Eigen::AngleAxisd(base.yaw_rad, Eigen::Vector3d::UnitZ()));
  T_map_base.translation() = base.at;
  return ground_patch(map.ground(rules), T_map_base, PatchLayout::grid());
}

Json patch_json(const planning::AskedMap& map, const Request& asked) {
  const GroundPatch patch = find_patch(map, asked.base);
  Json cells = Json::array();
  for (const PatchCell cell : patch.cell)
    cells.push_back(patch_cell_names.at(static_cast<std::size_t>(cell)));
  Json slopes = Json::array();  // NaN becomes null
  for (const float slope : patch.slope_rad) slopes.push_back(slope * deg_per_rad);
  return Json{{"points", PatchLayout::grid().points},
              {"height_m", patch.height},
              {"cell", cells},
              {"slope_deg", slopes},
              {"edge_m", patch.edge_m}};
}

void print_patch(const planning::AskedMap& map, const Request& asked) {
  const GroundPatch patch = find_patch(map, asked.base);
  const std::vector<Eigen::Vector2d> points = PatchLayout::grid().points;
  std::printf("heights in cm from the base, seen from above, ahead up: # occupied, v below, . unseen\n");
  for (std::size_t i = points.size(); i-- > 0;) {
    if (patch.cell[i] == PatchCell::supported)
      std::printf("%5.0f", 100 * patch.height[i]);
    else
      std::printf("    %c", ". #v"[static_cast<std::size_t>(patch.cell[i])]);
    if (i == 0 || points[i - 1].x() < points[i].x()) std::printf("\n");
  }
}

}  // namespace

const std::vector<Question>& questions() {
  static const std::vector<Question> all{
      {"nearest", "X Y Z", "the place on a surface that is nearest to a point", slope_fields, nearest_json},
      {"below", "X Y Z", "the place on a surface that is met first straight below a point", slope_fields,
       below_json},
      {"box", "X Y Z X Y Z", "the surfaces in a box between two corners", box_fields, box_json},
      {"sphere", "X Y Z R", "the surfaces within R metres of a point", sphere_fields, sphere_json},
      {"ray", "X Y Z DX DY DZ", "the first surface along a ray from a point, in a direction", ray_fields,
       ray_json},
      {"voxel", "X Y Z", "the voxel that holds a point: its state, and whose it is", point_fields,
       voxel_json},
      {"foothold", "X Y Z YAW",
       "what a foot at this heading (degrees) would stand on, on the surface below a point, or why it "
       "cannot",
       foothold_fields, foothold_json},
      {"regions", "ID", "where on a surface the middle of a foot may be, so that all of it is supported",
       one_region_fields, region_json},
      {"stair", "X Y Z", "the stair nearest to this point: risers, treads, width, heading", stair_fields,
       [](const planning::AskedMap& map, const Request& asked) { return Json(find_stair(map, asked)); }},
      {"patch", "X Y Z YAW",
       "heights of the ground around a robot whose base is there, 32 x 20 cells of 5 cm", patch_fields,
       patch_json, print_patch}};
  return all;
}

}  // namespace octosurf
