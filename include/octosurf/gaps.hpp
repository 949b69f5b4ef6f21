#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <string_view>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// What is known of a place on a surface's plane.
enum class Ground {
  supported,  ///< the surface
  open,       ///< a void: rays passed through the plane and on behind it
  blocked,    ///< something else stands there
  unseen      ///< no ray reached it
};
/// By Ground.
inline constexpr std::array<std::string_view, 4> ground_names{"supported", "void", "blocked", "unseen"};
/// As in answers and files: "supported", "void", …
constexpr std::string_view ground_name(Ground ground) {
  return ground_names[static_cast<std::size_t>(ground)];
}

/// A place within a surface without readings of it.
struct Gap {
  Ground kind = Ground::unseen;  ///< not `supported`
  bool bridged = false;          ///< unseen, and part of the surface all the same: see find_gaps()
  double width_m = 0;            ///< diameter of the largest disc in it, to a voxel
  Polygon outline;               ///< surface's frame, along the sides of cells of d
};

/// A surface whose outline follows the reasons of its gaps.
struct GroundedSurface {
  SurfacePtr surface;     ///< as it was, but for `polygons`, `boundary` and `area_m2`
  std::vector<Gap> gaps;  ///< in order of their first cell, row by row
};

/// Tells a surface's voids from places that nobody saw, by the octree of the same scan. Mapping outlines a
/// surface by its readings alone: whatever is wider than h is a hole, everything narrower is closed. Here
///
/// 1. a place through which rays passed is a hole however narrow, from two voxels: the voxel on the plane is
///    free and those straight behind it, to max(2.5 d, 3 rms + d/2) (three voxels: poses that err by a voxel
///    let rays along a plane free two), and so are places beside it that are
///    free on the plane, as far as a ray that leans by 60° may go aside on that way. A void that ends less
///    deep counts where another surface bounds it, from two voxels on. Free space in front of a plane proves
///    nothing;
/// 2. an unseen gap is bridged, and part of the surface, if the spacing of the readings explains it:
///    - a disc as wide as the gap fits between gaps on less than half of the surface within three times as
///      far. The floor between a lidar's rings is whole so, and the shadow of a box on a densely seen floor
///      is not; or
///    - rays passed within two voxels before three quarters of it, so that nothing hid it, and readings that
///      fall anywhere leave such a disc empty in one of 10⁴ places: −n ln(1 − f) < 9 for n cells, of which a
///      share f has readings within three times as far;
/// 3. nothing is bridged whose widest disc meets a void or something that stands there, another surface from
///    two voxels above the plane, too, or that is wider than `widest_bridged_m`, at most widest_gap_m.
///
/// Not part of mapping: a ray may change a reason without a change of the surface. O(area / d²) octree
/// look-ups, some 0.5 µs a cell of edge d of the surface's extent, 50 ms for 100 m² at 5 cm. Throws
/// Error(usage) for a surface of more than 2 km, or 2²⁸ cells.
GroundedSurface find_gaps(const Surface& surface, const OccupancyView& octree,
                          double widest_bridged_m = std::numeric_limits<double>::infinity());

/// m; wider than the step of any legged robot, whose planner gains nothing from a floor made of guesses.
inline constexpr double widest_gap_m = 1;

/// The snapshot with each surface as find_gaps() tells; ids, revisions and everything else unchanged.
std::shared_ptr<const Snapshot> with_gaps(const Snapshot& snapshot, const OccupancyView& octree,
                                          double widest_bridged_m = std::numeric_limits<double>::infinity(),
                                          std::map<SurfaceId, std::vector<Gap>>* gaps = nullptr);

/// Widest unseen gap that a contact may span, m: `share` of its narrower side. If a gap of a quarter lies
/// along the contact's edge and is a void after all, the pressure's centre is still a quarter of that side
/// from the edge of what is left.
double widest_unseen_of(const ContactShape& shape, double share = 0.25);

/// What is known of a place, surface's frame: supported within `surface.polygons`, else by the octree.
Ground ground_at(const Surface& surface, const OccupancyView& octree, const Eigen::Vector2d& uv);

/// Shares of a contact's area over each Ground, at points d/2 apart, 64 at most along its longer side.
std::array<double, ground_names.size()> ground_under(const Surface& surface, const OccupancyView& octree,
                                                     const ContactShape& shape,
                                                     const Eigen::Isometry3d& T_map_contact);

}  // namespace octosurf
