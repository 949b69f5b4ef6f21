#pragma once

#include "planning/questions.hpp"

#include <string>
#include <vector>

#include <octosurf/page.hpp>

namespace octosurf {

/// A foot's contact regions on all surfaces, with the limits of `plan` for such a foot: a biped's for a sole,
/// a quadruped's for a ball. `text`: as of --foot, with @YAW (degrees) for one heading. Throws Error(usage)
/// for an invalid foot. Seconds to minutes: obstacles on a floor are cut out of it voxel by voxel.
PageFoot page_foot(const planning::AskedMap& map, const std::string& text);

/// The feet of a page by default: a biped's sole and a quadruped's ball, as of `plan`, limited by slope and
/// edges only, as their names say. Some ms.
std::vector<PageFoot> usual_page_feet(const planning::AskedMap& map);

}  // namespace octosurf
