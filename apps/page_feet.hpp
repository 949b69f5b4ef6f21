#pragma once

#include "contact_query.hpp"

#include <string>
#include <vector>

#include <octosurf/page.hpp>

namespace octosurf {

/// A foot's contact regions on all surfaces, with the limits that plan keeps for such a foot: a biped's for a
/// sole, a quadruped's for a ball. `text`: as --foot takes it, with @YAW (degrees) for one heading. Throws
/// Error(usage) for text that is no foot. Seconds to minutes: what stands on a floor is cut out of it voxel
/// by voxel.
PageFoot page_foot(const AskedMap& map, const std::string& text);

/// What a page shows if it is not told which feet: a biped's sole and a quadruped's ball, as plan has them,
/// with slope and edges for their only limits, as their names say. Some ms.
std::vector<PageFoot> usual_page_feet(const AskedMap& map);

}  // namespace octosurf
