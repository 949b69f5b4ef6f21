#pragma once

#include <string>
#include <vector>

#include <octosurf/export.hpp>
#include <octosurf/footsteps.hpp>

namespace octosurf {

/// One JSON object, "octosurf-plan" of docs/formats.md: map frame, metres and degrees.
std::string to_json(const FootstepPlan& plan, const Robot& robot);

/// The soles of a plan's steps, slightly above the surfaces to be visible: start_left, …, step_1_right, …;
/// those of the start grey, left ones red, right ones green (a quadruped's hind feet paler).
std::vector<NamedMesh> footprints(const FootstepPlan& plan, const Robot& robot);

}  // namespace octosurf
