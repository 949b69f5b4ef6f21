#include "questions.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/stairs_json.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/error.hpp>
#include <octosurf/ground_patch.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 3> state_names{"unknown", "free", "occupied"};  // by State

Eigen::Vector3d point_at(const Request& asked, std::size_t first = 0) {
  return Eigen::Vector3d(asked.numbers.data() + first);
}

// Places.

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
  return place_json(map, map.index.nearest(point_at(asked), limit_of(map, asked)), "has no such surfaces");
}

Json below_json(const planning::AskedMap& map, const Request& asked) {
  return place_json(map, map.index.below(point_at(asked), limit_of(map, asked)),
                    "has no such surface below that place");
}

Json box_json(const planning::AskedMap& map, const Request& asked) {
  Eigen::AlignedBox3d box(point_at(asked));
  box.extend(point_at(asked, 3));
  return Json{{"surfaces", map.index.in(ConvexSpace::box(box))}};
}

Json sphere_json(const planning::AskedMap& map, const Request& asked) {
  return Json{{"surfaces", map.index.in_sphere(point_at(asked), asked.numbers[3])}};
}

/// A ray may meet nothing.
Json ray_json(const planning::AskedMap& map, const Request& asked) {
  const auto hit = map.index.first_on_ray(point_at(asked), point_at(asked, 3));
  if (!hit) return Json{{"surface", nullptr}};
  return Json{{"surface", hit->id},
              {"point", hit->point},
              {"distance_m", hit->distance},
              {"side", hit->front ? "front" : "back"}};
}

Json voxel_json(const planning::AskedMap& map, const Request& asked) {
  const OccupancyView::Voxel voxel = map.octree.at(point_at(asked));
  const bool known = voxel.state != OccupancyView::State::unknown;
  return Json{{"state", state_names.at(static_cast<std::size_t>(voxel.state))},
              {"log_odds", known ? Json(voxel.log_odds) : Json()},
              {"surface", voxel.surface != 0 ? Json(voxel.surface) : Json()}};
}

// Footholds and contact regions.

Json foothold_json(const planning::AskedMap& map, const Request& asked) {
  planning::ContactQuestion question = asked.contact;
  question.at = point_at(asked);
  question.yaw_rad = asked.numbers[3] * rad_per_deg;
  const planning::FoundFoothold answer = planning::find_foothold(map, question);
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

Json ring_json(const Surface& surface, const Ring2& ring) {
  Json points = Json::array();
  for (const Eigen::Vector2d& uv : ring) points.push_back(surface.to_map(uv));
  return points;
}

Json region_json(const planning::AskedMap& map, const Request& asked) {
  planning::ContactQuestion question = asked.contact;
  const double id = asked.numbers[0];
  if (!(id >= 1 && id <= double{last_id} && id == std::floor(id)))
    throw Error(Error::Kind::usage, "--regions", "is no surface's id", "octosurf info lists them");
  question.surface = static_cast<SurfaceId>(id);
  const auto& [surface, region, pieces] = planning::find_region(map, question);
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

Stair find_stair(const planning::AskedMap& map, const Request& asked) {
  const GroundView ground = map.bare_ground();
  if (const Stair* stair = nearest_stair(*map.snapshot, ground.stairs().stairs, point_at(asked)))
    return *stair;
  throw Error(Error::Kind::data, map.name, "has no stair", "map more of it first");
}

GroundPatch find_patch(const planning::AskedMap& map, const Request& asked) {
  GroundRules rules = GroundRules::of(Biped{}, map.octree.resolution());
  rules.limits.up = map.up;
  Eigen::Isometry3d T_map_base(upright(map.up).inverse() *
                               Eigen::AngleAxisd(asked.numbers[3] * rad_per_deg, Eigen::Vector3d::UnitZ()));
  T_map_base.translation() = point_at(asked);
  return ground_patch(map.ground(rules), T_map_base, PatchLayout::grid());
}

Json patch_json(const planning::AskedMap& map, const Request& asked) {
  const GroundPatch patch = find_patch(map, asked);
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
  const GroundPatch patch = find_patch(map, asked);
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
      {"nearest", "X Y Z", "the place on a surface that is nearest to a point", 3, nearest_json},
      {"below", "X Y Z", "the place on a surface that is met first straight below a point", 3, below_json},
      {"box", "X Y Z X Y Z", "the surfaces in a box between two corners", 6, box_json},
      {"sphere", "X Y Z R", "the surfaces within R metres of a point", 4, sphere_json},
      {"ray", "X Y Z DX DY DZ", "the first surface along a ray from a point, in a direction", 6, ray_json},
      {"voxel", "X Y Z", "the voxel that holds a point: its state, and whose it is", 3, voxel_json},
      {"foothold", "X Y Z YAW",
       "what a foot at this heading (degrees) would stand on, on the surface below a point, or why it "
       "cannot",
       4, foothold_json},
      {"regions", "ID", "where on a surface the middle of a foot may be, so that all of it is supported", 1,
       region_json},
      {"stair", "X Y Z", "the stair nearest to this point: risers, treads, width, heading", 3,
       [](const planning::AskedMap& map, const Request& asked) { return Json(find_stair(map, asked)); }},
      {"patch", "X Y Z YAW",
       "heights of the ground around a robot whose base is there, 32 x 20 cells of 5 cm", 4, patch_json,
       print_patch}};
  return all;
}

}  // namespace octosurf
