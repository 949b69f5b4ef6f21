#pragma once

#include "detection/detector.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// Assigns points inside known surfaces or at their boundaries (paper, III-B1): of the nearby surfaces whose
/// plane hash covers the point's cell, the one that explains it best. `fresh`: pending points. Cost: the few
/// surfaces in the blocks around each.
std::vector<Assignment> add_inliers(const surfaces::MapView& map, std::span<const PointId> fresh);

/// Expands surfaces over their boundaries through the octree (paper, III-B2), from rim cells to the pending
/// points that have one of them as neighbour (Neighbours, at most h away), each of which joins the surface
/// that explains it best; then from these, until none is left. Then to pieces of pending points across a gap,
/// at most h away along the plane from such a cell, and from these again. `fresh`: points that came or joined
/// a surface since the last expansion. Those that are pending look for all rims; the others, if at a rim, and
/// what is gained are looked for by all that is pending: no other pair of the two is new.
///
/// 1. A point must fit every plane within two standard deviations of the surface's.
/// 2. Expansion does not cross a surface at an angle, nor a gap in which readings lie off the plane.
/// 3. A piece beyond a gap needs at least five points, and more than there are points beside it that do not
///    fit the plane or have another surface: else another plane passes there.
/// 4. Each connected piece of five points or more that a surface gains is one patch. It stays pending unless
///    one plane is likelier than two (log_same), without the boundary prior, which favours any contact.
/// 5. All points of a round are decided before any is assigned. Pieces beyond gaps are claimed one by one, in
///    the order of their keys; points of a piece that failed are not tried with other surfaces in that round.
/// Cost: `fresh`, and the points within h of it and of what is gained.
std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> fresh);

/// Those of these points, but the pending ones, that another surface within h also explains: the two may be
/// one.
std::vector<PointId> touching(const surfaces::MapView& map, std::span<const PointId> owned);

}  // namespace octosurf::detection
