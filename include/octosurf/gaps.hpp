#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include <octosurf/contact.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// State of a place on a surface's plane.
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

/// A place within a surface without readings of it. Mapping outlines a surface by its readings alone: gaps
/// wider than h are holes, narrower ones are closed. GroundView (ground.hpp) classifies them by the octree of
/// the same scan:
///
/// 1. Void: rays passed through, so it is a hole however narrow (from two voxels). The voxel on the plane and
///    those straight behind it are free, to max(2.5 d, 3 rms + d/2): three voxels, because with poses off by
///    a voxel, rays along a plane free two. Places beside it belong to it if they are free on the plane and a
///    ray that leans by 60° could reach them on its way to that depth. A void that ends earlier counts if
///    another surface bounds it, from two voxels on. Free space in front of a plane proves nothing.
///    Narrow voids, whose voxels are full of their own sides: a reading behind the plane was seen through it.
///    Where its ray crossed the plane inside the outline, a disc of 1.5 voxels or more without readings of
///    the surface is a void.
/// 2. Bridged: an unseen gap is part of the surface if the spacing of the readings explains it. Either
///    - discs as wide as the gap fit on less than half of the surface between gaps, within three of their
///      radii: so the floor between a lidar's rings is whole, but the shadow of a box on a densely seen floor
///      is not. Or
///    - nothing hid it (rays passed within two voxels in front of three quarters of it), and readings at
///      random places would leave such a disc empty by chance: −n ln(1 − f) < 9 for n cells, where f is the
///      share of cells with readings within three radii.
/// 3. A gap is not bridged if its widest disc meets a void, an obstacle or another surface from two voxels
///    above the plane, or if it is wider than its rules' widest unseen gap or widest_gap_m.
/// 4. What the outline closed is opened again where neither rule of 2 explains it, from a disc of two voxels.
///
/// O(area / d²), some 0.5 µs a cell of edge d, 0.06 s for 63 m² of surfaces at 2 cm. Throws Error(usage) for
/// a surface of more than 2 km, or 2²⁸ cells.
struct Gap {
  Ground kind = Ground::unseen;  ///< not `supported`
  bool bridged = false;          ///< unseen, but part of the surface: see above
  double width_m = 0;            ///< diameter of the largest disc in it, to a voxel
  Polygon outline;               ///< surface's frame, along the sides of cells of d
};

/// Largest gap that is ever bridged, m: wider than any legged robot's step.
inline constexpr double widest_gap_m = 1;

/// Widest unseen gap that a contact may span, m: `share` of its narrower side. Even if a gap of a quarter at
/// the contact's edge turns out to be a void, the centre of pressure stays a quarter of that side from the
/// edge of the rest.
double widest_unseen_of(const ContactShape& shape, double share = 0.25);

}  // namespace octosurf
