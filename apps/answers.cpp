#include "answers.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/page_messages.hpp"

#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;
using planning::PlaceQuestion;

}  // namespace

void require_found(const planning::AskedMap& map, const PlaceQuestion& question,
                   const planning::PlaceAnswer& found) {
  const bool below = question.kind == PlaceQuestion::below;
  if (!found.found && (below || question.kind == PlaceQuestion::nearest))
    throw Error(Error::Kind::data, map.name,
                below ? "has no such surface below that place" : "has no such surfaces",
                "map more scans first, or allow a greater slope (--max-slope, max_slope_deg)");
}

std::string place_json(const planning::AskedMap& map, const PlaceQuestion& question,
                       const planning::PlaceAnswer& found) {
  if (question.kind == PlaceQuestion::sphere || question.kind == PlaceQuestion::box)
    return Json{{"surfaces", found.surfaces}}.dump();
  Json json{{"surface", nullptr}};
  if (question.kind == PlaceQuestion::voxel) {
    json = {{"state", state_name(found.voxel.state)}, {"log_odds", nullptr}, {"surface", nullptr}};
    if (found.voxel.state != OccupancyView::State::unknown) json["log_odds"] = found.voxel.log_odds;
  }
  if (!found.surfaces.empty()) json["surface"] = found.surfaces[0];
  if (!found.found) return json.dump();
  json["point"] = found.point;
  json["distance_m"] = found.distance_m;
  if (question.kind == PlaceQuestion::ray) {
    json["side"] = found.front ? "front" : "back";
    return json.dump();
  }
  const Surface& surface = map.surface(found.surfaces[0]);
  json["normal"] = surface.plane.normal;
  json["slope_deg"] = slope_rad(surface, map.up) * deg_per_rad;
  json["area_m2"] = surface.area_m2;
  return json.dump();
}

std::string foothold_json(const planning::FoundFoothold& answer) {
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
                  {"point", Eigen::Vector3d(found.T_map_contact.translation())},
                  {"normal", Eigen::Vector3d(found.T_map_contact.linear().col(2))},
                  {"heading", Eigen::Vector3d(found.T_map_contact.linear().col(0))}};
  return json.dump();
}

std::string region_json(const planning::FoundRegion& found) {
  Json json = io::region_json(*found.surface, found.region);
  json["pieces"] = Json::array();
  for (const ConvexPiece& piece : found.pieces) json["pieces"].push_back(piece.vertices);
  return json.dump();
}

std::string patch_json(const PatchLayout& layout, const GroundPatch& patch) {
  Json cells = Json::array();
  for (const PatchCell cell : patch.cell)
    cells.push_back(patch_cell_names.at(static_cast<std::size_t>(cell)));
  Json slopes = Json::array();  // NaN becomes null
  for (const float slope : patch.slope_rad) slopes.push_back(slope * deg_per_rad);
  return Json{{"points", layout.points},
              {"height_m", patch.height},
              {"cell", cells},
              {"slope_deg", slopes},
              {"edge_m", patch.edge_m}}
      .dump();
}

const char* state_name(OccupancyView::State state) {
  constexpr const char* names[] = {"unknown", "free", "occupied"};
  return names[static_cast<std::size_t>(state)];
}

}  // namespace octosurf
