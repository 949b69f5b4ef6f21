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
using planning::PlaceQuestion;

constexpr std::array<const char*, 3> state_names{"unknown", "free", "occupied"};  // by State
constexpr double last_revision = 9007199254740991.0;  // JSON has no larger whole numbers

// Places.

template <PlaceQuestion::Kind kind>
Fields place_fields(Request& asked) {
  PlaceQuestion& q = asked.place;
  q.kind = kind;
  if (kind == PlaceQuestion::box)
    return {point_field("min", "a corner, m", q.point).needed(),
            point_field("max", "the opposite one, m", q.corner).needed()};
  if (kind == PlaceQuestion::sphere)
    return {point_field("center", "m", q.point).needed(),
            number_field("radius_m", "m", q.distance_m, 0, farthest_m).needed()};
  if (kind == PlaceQuestion::ray)
    return {point_field("from", "where it begins, m", q.point).needed(),
            point_field("direction", "of any length", q.direction).needed()};
  Fields fields{point_field("point", "m", q.point).needed()};
  if (kind != PlaceQuestion::voxel)
    fields.push_back(number_field("max_slope_deg",
                                  "only surfaces that slope so much at most; 90 leaves out ceilings",
                                  asked.contact.max_slope_rad, 0, 180, rad_per_deg)
                         .by_default("180"));
  return fields;
}

/// A ray may meet nothing.
planning::PlaceAnswer find_place(const planning::AskedMap& map, const Request& asked) {
  PlaceQuestion question = asked.place;
  question.max_slope_rad = asked.contact.max_slope_rad.value_or(std::numbers::pi);
  planning::PlaceAnswer found = planning::answer(map, question);
  const bool below = question.kind == PlaceQuestion::below;
  if (!found.found && (below || question.kind == PlaceQuestion::nearest))
    throw Error(Error::Kind::data, map.name,
                below ? "has no such surface below that place" : "has no such surfaces",
                "map more scans first, or allow a greater slope (--max-slope, max_slope_deg)");
  return found;
}

std::string place_json(const ServedMap& map, const Request& asked) {
  const auto kind = asked.place.kind;
  const planning::PlaceAnswer found = find_place(map.asked, asked);
  if (kind == PlaceQuestion::sphere || kind == PlaceQuestion::box)
    return Json{{"surfaces", found.surfaces}}.dump();
  Json json{{"surface", nullptr}};
  if (kind == PlaceQuestion::voxel) {
    json = {{"state", state_names.at(static_cast<std::size_t>(found.voxel.state))},
            {"log_odds", nullptr},
            {"surface", nullptr}};
    if (found.voxel.state != OccupancyView::State::unknown) json["log_odds"] = found.voxel.log_odds;
  }
  if (!found.surfaces.empty()) json["surface"] = found.surfaces[0];
  if (!found.found) return json.dump();
  json["point"] = found.point;
  json["distance_m"] = found.distance_m;
  if (kind == PlaceQuestion::ray) {
    json["side"] = found.front ? "front" : "back";
    return json.dump();
  }
  const Surface& surface = map.asked.surface(found.surfaces[0]);
  json["normal"] = surface.plane.normal;
  json["slope_deg"] = slope_rad(surface, map.asked.up) * deg_per_rad;
  json["area_m2"] = surface.area_m2;
  return json.dump();
}

// Footholds and contact regions.

Fields foothold_fields(Request& asked) {
  Fields fields = contact_fields(asked.contact);
  fields.push_back(point_field("point", "m", asked.contact.at).needed());
  fields.push_back(
      number_field("yaw_deg", "heading, degrees", asked.contact.yaw_rad, -3600, 3600, rad_per_deg).needed());
  return fields;
}

std::string foothold_json(const ServedMap& map, const Request& asked) {
  const planning::FoundFoothold answer = planning::find_foothold(map.asked, asked.contact);
  const Foothold& found = answer.foothold;
  Json shares;
  for (std::size_t k = 0; k < answer.ground.size(); ++k)
    shares[std::string(ground_names[k])] = answer.ground[k];
  const Json json{{"surface", found.surface},
                  {"accepted", found.accepted},
                  {"refused", found.refused ? Json(contact_refusal_name(*found.refused)) : Json()},
                  {"supported", found.supported},
                  {"ground", shares},
                  {"margin_m", found.margin_m},
                  {"off_m", answer.off_m},
                  {"point", Eigen::Vector3d(found.T_map_contact.translation())},
                  {"normal", Eigen::Vector3d(found.T_map_contact.linear().col(2))},
                  {"heading", Eigen::Vector3d(found.T_map_contact.linear().col(0))}};
  return json.dump();
}

Fields one_region_fields(Request& asked) {
  Fields fields = region_fields(asked.contact);
  fields.push_back(number_field("surface", "its id", asked.contact.surface, 1, last_id).needed());
  return fields;
}

Json ring_json(const Surface& surface, const Ring2& ring) {
  Json points = Json::array();
  for (const Eigen::Vector2d& uv : ring) points.push_back(surface.to_map(uv));
  return points;
}

std::string region_json(const ServedMap& map, const Request& asked) {
  const auto& [surface, region, pieces] = planning::find_region(map.asked, asked.contact);
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
  return json.dump();
}

// Stairs and patches.

constexpr double anywhere_m = std::numeric_limits<double>::infinity();

Fields stair_fields(Request& asked) {
  return {point_field("point", "m", asked.place.point, anywhere_m).needed()};
}

Stair find_stair(const planning::AskedMap& map, const Request& asked) {
  const GroundView ground = map.bare_ground();
  if (const Stair* stair = nearest_stair(*map.snapshot, ground.stairs().stairs, asked.place.point))
    return *stair;
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

std::string patch_json(const ServedMap& map, const Request& asked) {
  const GroundPatch patch = find_patch(map.asked, asked.base);
  Json cells = Json::array();
  for (const PatchCell cell : patch.cell)
    cells.push_back(patch_cell_names.at(static_cast<std::size_t>(cell)));
  Json slopes = Json::array();  // NaN becomes null
  for (const float slope : patch.slope_rad) slopes.push_back(slope * deg_per_rad);
  return Json{{"points", PatchLayout::grid().points},
              {"height_m", patch.height},
              {"cell", cells},
              {"slope_deg", slopes},
              {"edge_m", patch.edge_m}}
      .dump();
}

void print_patch(const ServedMap& map, const Request& asked) {
  const GroundPatch patch = find_patch(map.asked, asked.base);
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

// What only the server is asked.

Fields changes_fields(Request& asked) {
  const auto take = [&asked](const std::vector<double>& v) {
    asked.since = static_cast<std::uint64_t>(v[0]);
  };
  return {{"since", "a revision that an earlier answer gave; everything, if it is not given", 1, 0,
           last_revision, take, true},
          text_field("run", "whose revision that is, as the answer says", {},
                     [&asked](const std::string& text) { asked.run = text; })};
}

}  // namespace

const std::vector<Question>& questions() {
  static const std::vector<Question> all{
      {"nearest", "X Y Z", "/api/query/nearest", "the place on a surface that is nearest to a point",
       place_fields<PlaceQuestion::nearest>, place_json},
      {"below", "X Y Z", "/api/query/below",
       "the place on a surface that is met first straight below a point", place_fields<PlaceQuestion::below>,
       place_json},
      {"box", "X Y Z X Y Z", "/api/query/box", "the surfaces in a box between two corners",
       place_fields<PlaceQuestion::box>, place_json},
      {"sphere", "X Y Z R", "/api/query/sphere", "the surfaces within R metres of a point",
       place_fields<PlaceQuestion::sphere>, place_json},
      {"ray", "X Y Z DX DY DZ", "/api/query/ray",
       "the first surface along a ray from a point, in a direction", place_fields<PlaceQuestion::ray>,
       place_json},
      {"voxel", "X Y Z", "/api/query/voxel", "the voxel that holds a point: its state, and whose it is",
       place_fields<PlaceQuestion::voxel>, place_json},
      {"foothold", "X Y Z YAW", "/api/query/foothold",
       "what a foot at this heading (degrees) would stand on, on the surface below a point, or why it "
       "cannot",
       foothold_fields, foothold_json},
      {"regions", "ID", "/api/regions",
       "where on a surface the middle of a foot may be, so that all of it is supported", one_region_fields,
       region_json},
      {"stair", "X Y Z", "", "the stair nearest to this point: risers, treads, width, heading", stair_fields,
       [](const ServedMap& map, const Request& asked) { return Json(find_stair(map.asked, asked)).dump(); }},
      {"patch", "X Y Z YAW", "",
       "heights of the ground around a robot whose base is there, 32 x 20 cells of 5 cm", patch_fields,
       patch_json, print_patch},
      {"", "", "/api/changes",
       "what became of the surfaces since a revision, and those that appeared or changed as they are now",
       changes_fields,
       [](const ServedMap& map, const Request& asked) { return map.changes_json(asked.since, asked.run); }},
      {"", "", voxels_path, "the octree's occupied voxels, packed as for the page",
       [](Request&) { return Fields{}; }, nullptr}};
  return all;
}

}  // namespace octosurf
