#pragma once

#include <string>
#include <vector>

#include <octosurf/export.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {

/// One JSON object, in the map frame, metres and degrees: {"format": "octosurf-plan", "version": 1, "found",
/// "cost", "lower_bound", "expansions", "search_ms", "start": [foot …], "steps": [foot …],
/// "body": [{"at", "yaw_deg"} …]}, where a foot is {"foot", "surface", "at", "yaw_deg", "T_map_foot": 16
/// numbers row by row, "margin_m", "outline": [[x, y, z] …]}. Without a plan also "refusal": {"why",
/// "sentence", "contact", "nearest", "nearest_m", "refused": {"reach", "height", "clearance", "support",
/// "unknown"}}, each null where absent.
std::string to_json(const FootstepPlan& plan, const Robot& robot);

/// The soles of a plan's steps, slightly above the surfaces to be visible: start_left, …, step_1_right, …;
/// those of the start grey, left ones red, right ones green (a quadruped's hind feet paler).
std::vector<NamedMesh> footprints(const FootstepPlan& plan, const Robot& robot);

}  // namespace octosurf
