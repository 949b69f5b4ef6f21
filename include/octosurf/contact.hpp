#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// The shape that touches a surface: the sole of a foot, or a palm. In the contact's own frame, metres: its
/// reference point is the origin, x points forward, y to the left, z away from the surface.
struct ContactShape {
  Ring2 outline;      ///< convex, counter-clockwise, at least three vertices; empty: a disc
  double radius = 0;  ///< of a disc

  /// A sole whose reference point is `behind` m in front of its heel (its middle by default).
  static ContactShape rectangle(double length, double width, std::optional<double> behind = {});
  /// A disc about its reference point: a ball of a foot, at any heading.
  static ContactShape disc(double radius);

  /// Largest distance of the shape from its reference point.
  double reach() const;
};

/// Reason why a contact is rejected.
enum class ContactRefusal {
  slope,        ///< the surface slopes more than max_slope_rad
  size,         ///< the surface has less area than min_area_m2
  roughness,    ///< the inliers scatter more than max_rms_m about the plane
  uncertainty,  ///< the plane's uncertainty exceeds max_normal_std_rad or max_offset_std_m
  support,      ///< part of the contact lies beyond the surface's edge, or over a hole or gap
  margin,       ///< supported, but nearer to such an edge than edge_margin_m
  obstacle,     ///< an obstacle stands within obstacle_margin_m of it
  clearance,    ///< an obstacle hangs over it lower than clearance_m
  unknown       ///< the space over it is unknown: unknown_to_m
};
/// By ContactRefusal.
inline constexpr std::array<std::string_view, 9> contact_refusal_names{
    "slope", "size", "roughness", "uncertainty", "support", "margin", "obstacle", "clearance", "unknown"};
/// As in answers and files: "slope", "size", …
constexpr std::string_view contact_refusal_name(ContactRefusal refusal) {
  return contact_refusal_names[static_cast<std::size_t>(refusal)];
}

/// Requirements of a contact. By default only slope and support are checked: ground.hpp has safe ones.
struct ContactLimits {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, any length; see up_of(map)
  double max_slope_rad = std::numbers::pi / 6;    ///< of the surface; π: any, walls and ceilings too
  double min_area_m2 = 0;                         ///< of the surface
  std::optional<double> max_rms_m{};              ///< roughness; empty: any
  std::optional<double> max_normal_std_rad{};     ///< empty: any
  std::optional<double> max_offset_std_m{};       ///< empty: any
  /// Minimum distance between the contact and every edge. Outlines extend beyond the true edge by up to d,
  /// because their outermost readings lie in voxels that the edge crosses, and by more where readings err by
  /// more. docs/usage.md lists how many wrong footholds each margin accepts.
  double edge_margin_m = 0;
  /// Minimum distance between the contact and obstacles above the surface: occupied voxels that do not belong
  /// to it and lie partly between `obstacle_from_m` and `clearance_m` over its plane (room for a shin or
  /// swing). 0: not checked; needs a clearance.
  double obstacle_margin_m = 0;
  double obstacle_from_m = 0.05;  ///< m over the plane; lower voxels are no obstacles
  /// Height over the contact that must be free of such voxels; m along the normal. 0: not checked.
  double clearance_m = 0;
  /// Height over the contact up to which, from obstacle_from_m, nothing may be unknown where something three
  /// voxels wide could hide: narrower unknown space lies between rays. 0: unknown counts as free.
  double unknown_to_m = 0;
};

/// Where on one surface the reference point of a contact may lie so that the whole contact is supported and
/// every limit is met.
struct ContactRegion {
  SurfaceId surface = 0;          ///< the surface
  std::uint64_t revision = 0;     ///< of the surface it was made from
  std::optional<double> yaw_rad;  ///< empty: valid for every heading
  std::vector<Polygon> polygons;  ///< surface frame; may have holes and several parts
  double area_m2 = 0;             ///< of `polygons`
  /// If there is no polygon: each limit that alone rejects everything; if only their combination does, all of
  /// them.
  std::vector<ContactRefusal> refused;
};

/// Direction of a contact's x axis in the surface's frame for a heading of `yaw_rad` about `up`,
/// counter-clockwise from the map's x axis (of the map turned by upright(up), up.hpp): the heading projected
/// onto the plane, or `up` projected if the heading is normal to the plane.
Eigen::Vector2d heading_on(const Surface& surface, double yaw_rad, const Eigen::Vector3d& up);

/// The contact region of `surface`, for one heading or (empty) for all: a disc of reach() about the reference
/// point. `octree` is read for obstacles, clearance and unknown space, and may be null if the limits need
/// none. `others`: the surfaces of the octree's voxels, of the same scan. Obstacles then extend to their
/// planes, within three standard deviations; without (nullptr) each voxel counts as filled. The readings of a
/// wall seen from afar scatter over several voxels, so footholds a few centimetres beside it would be
/// refused.
///
/// On cells of d/4 of the surface's plane: those that an edge, an obstacle or unknown space touches are
/// dilated by the contact and its margins; what is left are rings along cells, simplified inward.
/// 1. Safe: a contact at any point of it lies on one polygon of the surface and keeps every margin (checked
///    in exact arithmetic).
/// 2. Complete except for 5 mm along its outline at d = 2 cm on average, 15 mm at most; discs and arcs count
///    as polygons about them (at most 0.5 % larger), and voxels of no surface or unknown as full.
/// 4 ms within 2 m of a place at d = 2 cm, and 0.5 µs for each voxel over it. Throws Error(usage) for an
/// invalid shape, invalid or incomplete limits, or a surface a kilometre from its frame's origin.
ContactRegion contact_region(const Surface& surface, const ContactShape& shape, std::optional<double> yaw_rad,
                             const ContactLimits& limits = {}, const OccupancyView* octree = nullptr,
                             const Snapshot* others = nullptr);

/// One contact at a place, with its evaluation.
struct Foothold {
  SurfaceId surface = 0;                                            ///< the surface
  Eigen::Isometry3d T_map_contact = Eigen::Isometry3d::Identity();  ///< on the plane, z along its normal
  double supported = 0;  ///< share of the contact's area that lies on the surface, [0, 1]
  /// Distance from the contact to the nearest edge, up to farthest_margin_m. Negative: by how much the
  /// contact would have to shrink on all sides to be supported, at most half its width. To a cell of d/4.
  double margin_m = 0;
  static constexpr double farthest_margin_m = 0.25;  ///< farther edges are not looked for
  bool accepted = false;                             ///< every limit is met
  std::optional<ContactRefusal> refused;  ///< the first limit not met, in the order of ContactRefusal
};

/// Evaluates a contact whose reference point is `at`, projected onto the plane along its normal, on the cells
/// of contact_region(): accepted wherever its reference point lies in that region, and up to 15 mm beside it
/// (at d = 2 cm), as the place itself is not rounded to cells. O(vertices), some 20 ns each; with a clearance
/// O(voxels there), some tens of µs. Throws as contact_region().
Foothold foothold(const Surface& surface, const ContactShape& shape, const Eigen::Vector3d& at,
                  double yaw_rad, const ContactLimits& limits = {}, const OccupancyView* octree = nullptr,
                  const Snapshot* others = nullptr);

}  // namespace octosurf
