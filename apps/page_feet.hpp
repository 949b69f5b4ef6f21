#pragma once

#include "planning/questions.hpp"

#include <string>
#include <vector>

#include <octosurf/page.hpp>

namespace octosurf {

/// Contact regions on all surfaces for feet as of --foot, for any heading, with the limits of `plan` for such
/// a foot: a biped's for a sole, a quadruped's for a ball. Throws Error(usage) for an invalid foot. Seconds
/// to minutes: obstacles on a floor are cut out of it voxel by voxel. Without feet: those of `plan`, limited
/// by slope and edges alone, in some ms.
std::vector<PageFoot> page_feet(const planning::AskedMap& map, const std::vector<std::string>& feet = {});

}  // namespace octosurf
