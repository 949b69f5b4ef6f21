#include "io/exporters/stairs_json.hpp"

#include "geometry/degrees.hpp"
#include "io/exporters/export_formats.hpp"

#include <nlohmann/json.hpp>

void nlohmann::adl_serializer<octosurf::Cylinder>::to_json(ordered_json& json,
                                                           const octosurf::Cylinder& cylinder) {
  json = {{"id", cylinder.id},
          {"axis_point", octosurf::io::tidy(cylinder.axis_point)},
          {"axis", cylinder.axis},
          {"radius_m", cylinder.radius_m},
          {"length_m", cylinder.length_m},
          {"span_deg", cylinder.span_rad * octosurf::deg_per_rad},
          {"start", cylinder.start},
          {"inliers", cylinder.inliers},
          {"rms_m", cylinder.rms_m},
          {"revision", cylinder.revision}};
}

void nlohmann::adl_serializer<octosurf::Step>::to_json(ordered_json& json, const octosurf::Step& step) {
  json = {{"lower", step.lower},
          {"upper", step.upper},
          {"riser_m", step.riser_m},
          {"width_m", step.width_m},
          {"heading_deg", step.heading_rad * octosurf::deg_per_rad},
          {"edge", step.edge}};
}

void nlohmann::adl_serializer<octosurf::Stair>::to_json(ordered_json& json, const octosurf::Stair& stair) {
  const auto landing = [](octosurf::SurfaceId id) { return id == 0 ? ordered_json() : ordered_json(id); };
  json = {{"id", stair.id},
          {"kind", octosurf::stair_kind_names[static_cast<std::size_t>(stair.kind)]},
          {"risers", stair.steps.size()},
          {"riser_m", stair.riser.mean_m},
          {"riser_std_m", stair.riser.std_m},
          {"tread_m", stair.tread.mean_m},
          {"tread_std_m", stair.tread.std_m},
          {"width_m", stair.width_m},
          {"heading_deg", stair.heading_rad * octosurf::deg_per_rad},
          {"turn_deg", stair.turn_rad * octosurf::deg_per_rad},
          {"treads", stair.treads},
          {"landing_below", landing(stair.landing_below)},
          {"landing_above", landing(stair.landing_above)},
          {"steps", stair.steps}};
}
