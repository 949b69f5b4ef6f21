#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Points inside known surfaces or at their rims (paper, III-B1): of the surfaces near, those whose plane's
/// hash covers the point's cell, and of these the one that explains it best. `fresh`: pending points. Cost:
/// the few surfaces in the blocks around each.
std::vector<Assignment> add_inliers(const surfaces::MapView& map, std::span<const geometry::VoxelKey> fresh);

/// Expands surfaces over their boundaries through the octree (paper, III-B2): from `left`, pending points,
/// those beside inliers go to the surface that explains them best, then what is pending beside those, until
/// none is left. Beside: as Readings::near(), at most h away.
///
/// 1. A point must fit every plane within two standard deviations of the surface's.
/// 2. Nothing passes a surface at an angle that stands between.
/// 3. Each connected piece of what a surface gains is one patch. It stays pending unless the two are likelier
///    one plane than two (log_same). The rim's prior does not count: it would favour whatever touches.
/// 4. A round's points are all decided before any is assigned, so that no order matters.
/// Cost: new points and their neighbours.
std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const geometry::VoxelKey> left);

/// Of assigned points, those that another surface within h explains, too: the two may be one.
std::vector<geometry::VoxelKey> touching(const surfaces::MapView& map,
                                         std::span<const Assignment> assignments);

}  // namespace octosurf::detection
