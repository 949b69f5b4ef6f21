#include "answers.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/page_messages.hpp"

#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

std::string surfaces_json(const std::vector<SurfaceId>& ids) { return Json{{"surfaces", ids}}.dump(); }

std::string hit_json(const std::optional<RayHit>& hit) {
  if (!hit) return Json{{"surface", nullptr}}.dump();
  const Json json{{"surface", hit->id},
                  {"point", hit->point},
                  {"distance_m", hit->distance},
                  {"side", hit->front ? "front" : "back"}};
  return json.dump();
}

std::string voxel_json(const OccupancyView::Voxel& voxel) {
  Json json{{"state", state_name(voxel.state)}, {"log_odds", nullptr}, {"surface", nullptr}};
  if (voxel.state != OccupancyView::State::unknown) json["log_odds"] = voxel.log_odds;
  if (voxel.surface != 0) json["surface"] = voxel.surface;
  return json.dump();
}

std::string nearest_json(const Nearest& found, const Surface& surface, const Eigen::Vector3d& up) {
  const Json json{{"surface", found.id},
                  {"point", found.point},
                  {"distance_m", found.distance},
                  {"normal", surface.plane.normal},
                  {"slope_deg", slope_rad(surface, up) * deg_per_rad},
                  {"area_m2", surface.area_m2}};
  return json.dump();
}

std::string foothold_json(const Foothold& found, const std::array<double, ground_names.size()>& ground) {
  Json shares;
  for (std::size_t k = 0; k < ground.size(); ++k) shares[std::string(ground_names[k])] = ground[k];
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

std::string region_json(const Surface& surface, const ContactRegion& region,
                        const std::vector<ConvexPiece>& pieces) {
  Json json = io::region_json(surface, region);
  json["pieces"] = Json::array();
  for (const ConvexPiece& piece : pieces) json["pieces"].push_back(piece.vertices);
  return json.dump();
}

const char* state_name(OccupancyView::State state) {
  constexpr const char* names[] = {"unknown", "free", "occupied"};
  return names[static_cast<std::size_t>(state)];
}

}  // namespace octosurf
