#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Assigns points inside known surfaces or at their boundaries (paper, III-B1): of the nearby surfaces whose
/// plane hash covers the point's cell, the one that explains it best. `fresh`: pending points. Cost: the few
/// surfaces in the blocks around each.
std::vector<Assignment> add_inliers(const surfaces::MapView& map, std::span<const PointId> fresh);

/// Expands surfaces over their boundaries through the octree (paper, III-B2): pending points of `left` beside
/// inliers are assigned to the surface that explains them best, then pending points beside those, until none
/// is left. Beside: among their Neighbours, at most h away. Then pieces of pending points beyond a gap, with
/// a boundary cell of the plane's hash at most h away along the plane, and what lies beside and beyond these.
///
/// 1. A point must fit every plane within two standard deviations of the surface's.
/// 2. Expansion does not cross a surface at an angle, nor a gap in which readings lie off the plane.
/// 3. A piece beyond a gap needs at least five points, and most of the points beside it, of other surfaces
///    too, must fit the plane: else another plane passes there.
/// 4. Each connected piece that a surface gains is one patch. It stays pending unless one plane is likelier
///    than two (log_same). The boundary prior is not used: it would favour anything in contact.
/// 5. All points of a round are decided before any is assigned. Pieces beyond gaps are claimed one by one, in
///    the order of their keys; points of a piece that failed are not tried with other surfaces in that round.
/// Cost: new points and their neighbours.
///
/// Without guards only the paper's rule is left: round by round a point joins the surface that explains it
/// best of those with a boundary cell at most h away; tests compare it with a walk along the boundaries.
enum class Guards { on, off };
std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left,
                               Guards guards = Guards::on);

/// The assigned points that another surface within h also explains: the two may be one.
std::vector<PointId> touching(const surfaces::MapView& map, std::span<const Assignment> assignments);

}  // namespace octosurf::detection
