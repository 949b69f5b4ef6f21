#include "io/exporters/stairs_json.hpp"

#include "geometry/degrees.hpp"

#include <nlohmann/json.hpp>

namespace octosurf::io {
namespace {

nlohmann::ordered_json json_of_step(const Step& step) {
  return {{"lower", step.lower},
          {"upper", step.upper},
          {"riser_m", step.riser_m},
          {"width_m", step.width_m},
          {"heading_deg", step.heading_rad * deg_per_rad},
          {"edge", step.edge}};
}

nlohmann::ordered_json json_of_stair(const Stair& stair) {
  const auto landing = [](SurfaceId id) {
    return id == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(id);
  };
  nlohmann::ordered_json json{{"id", stair.id},
                              {"kind", stair_kind_names[static_cast<std::size_t>(stair.kind)]},
                              {"risers", stair.steps.size()},
                              {"riser_m", stair.riser.mean_m},
                              {"riser_std_m", stair.riser.std_m},
                              {"tread_m", stair.tread.mean_m},
                              {"tread_std_m", stair.tread.std_m},
                              {"width_m", stair.width_m},
                              {"heading_deg", stair.heading_rad * deg_per_rad},
                              {"turn_deg", stair.turn_rad * deg_per_rad},
                              {"treads", stair.treads},
                              {"landing_below", landing(stair.landing_below)},
                              {"landing_above", landing(stair.landing_above)},
                              {"steps", nlohmann::ordered_json::array()}};
  for (const Step& step : stair.steps) json["steps"].push_back(json_of_step(step));
  return json;
}

}  // namespace

std::string stair_json(const Stair& stair) { return json_of_stair(stair).dump(); }

std::string stairs_json(const std::vector<Stair>& stairs) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Stair& stair : stairs) list.push_back(json_of_stair(stair));
  return list.dump();
}

std::string steps_json(const std::vector<Step>& steps) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Step& step : steps) list.push_back(json_of_step(step));
  return list.dump();
}

}  // namespace octosurf::io
