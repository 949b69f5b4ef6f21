#include "geometry/degrees.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include <octosurf/plan_files.hpp>

namespace octosurf {
namespace {

using Json = nlohmann::ordered_json;

// m over the plane, so that a sole is visible at any angle; increasing, so that a later one covers an earlier
// one.
constexpr double raised = 0.006, raised_more = 0.0002;
constexpr int disc_corners = 24;

constexpr std::array<std::string_view, 4> why_names{"start", "goal", "unreachable", "budget"};

constexpr std::array<float, 3> start_color{0.35F, 0.35F, 0.38F};
constexpr std::array<std::array<float, 3>, foot_names.size()> foot_colors{{{0.85F, 0.12F, 0.12F},
                                                                           {0.08F, 0.60F, 0.20F},
                                                                           {0.85F, 0.12F, 0.12F},
                                                                           {0.08F, 0.60F, 0.20F},
                                                                           {0.95F, 0.55F, 0.50F},
                                                                           {0.50F, 0.80F, 0.55F}}};

const ContactShape& foot_of(const Robot& robot) {
  return std::visit([](const auto& kind) -> const ContactShape& { return kind.foot; }, robot);
}

std::vector<Eigen::Vector3d> outline_of(const Footstep& step, const ContactShape& foot, double height) {
  std::vector<Eigen::Vector3d> ring;
  for (const Eigen::Vector2d& p : foot.outline)
    ring.push_back(step.T_map_foot * Eigen::Vector3d(p.x(), p.y(), height));
  for (int i = 0; i < disc_corners && foot.outline.empty(); ++i) {
    const double angle = 2 * std::numbers::pi * i / disc_corners;
    ring.push_back(step.T_map_foot *
                   Eigen::Vector3d(foot.radius * std::cos(angle), foot.radius * std::sin(angle), height));
  }
  return ring;
}

Json step_json(const Footstep& step, const ContactShape& foot) {
  Json json{{"foot", foot_name(step.foot)},
            {"surface", step.surface},
            {"at", Eigen::Vector3d(step.T_map_foot.translation())},
            {"yaw_deg", step.yaw_rad * deg_per_rad}};
  Json& rows = json["T_map_foot"] = Json::array();
  for (int i = 0; i < 16; ++i) rows.push_back(step.T_map_foot(i / 4, i % 4));
  json["margin_m"] = step.margin_m;
  json["outline"] = outline_of(step, foot, 0);
  return json;
}

Json step_json(const NoPlan& refusal) {
  Json json{{"why", why_names.at(static_cast<std::size_t>(refusal.why))},
            {"sentence", refusal.sentence},
            {"contact", refusal.contact ? Json(contact_refusal_name(*refusal.contact)) : Json()},
            {"nearest", refusal.nearest ? Json(*refusal.nearest) : Json()},
            {"nearest_m", refusal.nearest ? Json(refusal.nearest_m) : Json()}};
  json["refused"] = Json();
  const bool searched = refusal.why == NoPlan::Why::unreachable || refusal.why == NoPlan::Why::budget;
  for (std::size_t i = 0; i < step_refusal_names.size() && searched && refusal.nearest; ++i)
    json["refused"][std::string(step_refusal_names[i])] = refusal.refused[i];
  return json;
}

NamedMesh foot_mesh(const Footstep& step, const ContactShape& foot, const std::string& name,
                    const std::array<float, 3>& color, double height) {
  NamedMesh result{name, color, {outline_of(step, foot, height), {}}};
  for (std::uint32_t i = 2; i < result.mesh.vertices.size(); ++i)
    result.mesh.triangles.push_back({0, i - 1, i});
  return result;
}

}  // namespace

std::string to_json(const FootstepPlan& plan, const Robot& robot) {
  const ContactShape& foot = foot_of(robot);
  Json json{{"format", "octosurf-plan"},       {"version", 1},
            {"found", plan.found()},           {"cost", plan.cost},
            {"lower_bound", plan.lower_bound}, {"expansions", plan.expansions},
            {"search_ms", plan.search_ms}};
  for (const auto& [name, feet] : {std::pair{"start", &plan.start}, std::pair{"steps", &plan.steps}}) {
    json[name] = Json::array();
    for (const Footstep& step : *feet) json[name].push_back(step_json(step, foot));
  }
  json["body"] = Json::array();
  for (const Standing& pose : plan.body)
    json["body"].push_back({{"at", pose.at}, {"yaw_deg", pose.yaw_rad * deg_per_rad}});
  if (plan.refusal) json["refusal"] = step_json(*plan.refusal);
  return json.dump(1);
}

std::vector<NamedMesh> footprints(const FootstepPlan& plan, const Robot& robot) {
  const ContactShape& foot = foot_of(robot);
  std::vector<NamedMesh> meshes;
  for (const Footstep& step : plan.start)
    meshes.push_back(
        foot_mesh(step, foot, "start_" + std::string(foot_name(step.foot)), start_color, raised));
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    meshes.push_back(
        foot_mesh(plan.steps[i], foot,
                  "step_" + std::to_string(i + 1) + "_" + std::string(foot_name(plan.steps[i].foot)),
                  foot_colors.at(static_cast<std::size_t>(plan.steps[i].foot)),
                  raised + raised_more * static_cast<double>(i + 1)));
  return meshes;
}

}  // namespace octosurf
