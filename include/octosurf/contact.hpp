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

#include <octosurf/boundary.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// What touches a surface: the sole of a foot, or a palm. In the contact's own frame, metres: its reference
/// point is the origin, x points forward, y to the left, z away from the surface.
struct ContactShape {
  Ring2 outline;      ///< convex, counter-clockwise, at least three vertices; empty: a disc
  double radius = 0;  ///< of a disc

  /// A sole whose reference point is `behind` m in front of its heel (its middle by default).
  static ContactShape rectangle(double length, double width, std::optional<double> behind = {});
  /// A disc about its reference point: a ball of a foot, at any heading.
  static ContactShape disc(double radius);

  /// The farthest that any part lies from the reference point.
  double reach() const;
};

/// Why no contact can be made somewhere.
enum class ContactRefusal {
  slope,        ///< the surface slopes more than max_slope_rad
  size,         ///< the surface has less area than min_area_m2
  roughness,    ///< the inliers scatter more than max_rms_m about the plane
  uncertainty,  ///< the plane is not known to max_normal_std_rad or max_offset_std_m
  support,      ///< a part of the contact lies beyond the surface's edge, or over a hole or gap
  margin,       ///< supported, but nearer to such an edge than edge_margin_m
  frontier,     ///< nearer to an edge nobody has looked beyond than frontier_margin_m
  obstacle,     ///< something stands within obstacle_margin_m of it
  clearance     ///< something hangs over it lower than clearance_m
};
/// By ContactRefusal.
inline constexpr std::array<std::string_view, 9> contact_refusal_names{
    "slope", "size", "roughness", "uncertainty", "support", "margin", "frontier", "obstacle", "clearance"};
/// As in answers and files: "slope", "size", …
constexpr std::string_view contact_refusal_name(ContactRefusal refusal) {
  return contact_refusal_names[static_cast<std::size_t>(refusal)];
}

/// What a contact needs. The defaults ask nothing but slope and support.
struct ContactLimits {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, any length; up_of(map) tells a map's
  double max_slope_rad = std::numbers::pi / 6;    ///< of the surface; π: any, walls and ceilings too
  double min_area_m2 = 0;                         ///< of the surface
  std::optional<double> max_rms_m{};              ///< roughness; empty: any
  std::optional<double> max_normal_std_rad{};     ///< empty: any
  std::optional<double> max_offset_std_m{};       ///< empty: any
  /// Between the contact and every edge. Outlines reach beyond what is there: their outermost readings lie in
  /// voxels that the true edge crosses, so by up to d, and more where readings err by more. See docs/usage.md
  /// for how many footholds are accepted with which margin that are not there.
  double edge_margin_m = 0;
  double frontier_margin_m = 0;  ///< between the contact and edges of kind frontier
  /// Between the contact and whatever is occupied above the surface: voxels that are not a part of it and of
  /// which any part lies between `obstacle_from_m` and `clearance_m` over its plane: room for a shin, for
  /// swing. 0: not asked; needs a clearance.
  double obstacle_margin_m = 0;
  double obstacle_from_m = 0.05;  ///< m over the plane; what is lower is no obstacle
  /// No such voxel stands straight over the contact itself; m along the normal. 0: the octree is not asked.
  double clearance_m = 0;
  /// Outlines bridge gaps narrower than max_hole_size: cracks between stones, say. Where the octree knows
  /// free space under the contact from the plane to so far behind it, m, rays went through: a gap, refused as
  /// support. 1.5 d asks for two voxels, so that noise is none. 0: not asked.
  double gap_depth_m = 0;
};

/// Where on one surface the reference point of a contact may be so that all of the contact is supported and
/// every limit is kept.
struct ContactRegion {
  SurfaceId surface = 0;          ///< the surface it is on
  std::uint64_t revision = 0;     ///< of the surface it was made from
  std::optional<double> yaw_rad;  ///< empty: any heading will do there
  std::vector<Polygon> polygons;  ///< surface frame; holes are kept, a region may be in parts
  double area_m2 = 0;             ///< of `polygons`
  /// If there is no polygon: every limit that leaves nothing by itself; if it takes several, all of them.
  std::vector<ContactRefusal> refused;
};

/// The direction in which a contact's x axis points, in the surface's frame, for a heading of `yaw_rad` about
/// `up`, counter-clockwise from the map's x axis (of the map turned upright(up), up.hpp): that heading
/// projected onto the plane; where it is at right angles to the plane, `up` projected.
Eigen::Vector2d heading_on(const Surface& surface, double yaw_rad, const Eigen::Vector3d& up);

/// The region of `surface`, for one heading or (empty) for all of them: a disc of reach() about the reference
/// point. `octree` is asked for obstacles and clearance, and may be null if the limits do not need it; edge
/// kinds (label_edges(), for frontier_margin_m) likewise. `others`: the surfaces that the octree's voxels
/// belong to, of the same scan. What stands on or hangs over this one is then where their planes are, within
/// three standard deviations of those; without (nullptr) each voxel counts as filled, and as the readings of
/// a wall that was seen from afar scatter over several, footholds a few centimetres beside it are refused.
///
/// 1. Safe: the Minkowski difference of each of the surface's polygons and the contact, rounded inward by a
///    few µm, so that a contact at any point of it lies on the surface (checked in exact arithmetic).
/// 2. Nothing that a foothold could use is left out but for those µm, arcs of margins and discs, which are
///    drawn by polygons around them (at most 0.5 % larger), and voxels of no surface, which stand for all
///    they cover.
/// 3. A contact lies on one polygon: it does not reach over the single points where two touch.
/// Some 0.2 µs for each of the surface's vertices; with a gap depth O(area / d²) questions to the octree,
/// too. Throws Error(usage) for a shape or limits that make no sense or miss what they need, or a surface a
/// kilometre from its frame's origin.
ContactRegion contact_region(const Surface& surface, const ContactShape& shape, std::optional<double> yaw_rad,
                             const ContactLimits& limits = {}, const OccupancyView* octree = nullptr,
                             const std::vector<PolygonEdges>* edges = nullptr,
                             const Snapshot* others = nullptr);

/// One contact at a place, and what is to be said about it.
struct Foothold {
  SurfaceId surface = 0;                                            ///< the surface it is on
  Eigen::Isometry3d T_map_contact = Eigen::Isometry3d::Identity();  ///< on the plane, z along its normal
  double supported = 0;  ///< share of the contact's area that lies on the surface, [0, 1]
  /// From the contact to the nearest edge. Negative: how much would have to be taken off all round the
  /// contact for it to be supported, half its width at most.
  double margin_m = 0;
  bool accepted = false;                  ///< every limit is kept
  std::optional<ContactRefusal> refused;  ///< the first that is not, in the order of ContactRefusal
};

/// Judges a contact whose reference point stands at `at` (projected onto the plane along its normal).
/// Accepted where its reference point lies in contact_region(), and but for the few µm by which that is
/// rounded only there. O(vertices), some 15 ns each; with a clearance or gap depth O(voxels there), some
/// tens of µs. Throws as contact_region().
Foothold foothold(const Surface& surface, const ContactShape& shape, const Eigen::Vector3d& at,
                  double yaw_rad, const ContactLimits& limits = {}, const OccupancyView* octree = nullptr,
                  const std::vector<PolygonEdges>* edges = nullptr, const Snapshot* others = nullptr);

/// At most `most` disjoint convex pieces inside a region, the largest first, that cover as much of its area
/// as they can: what mixed-integer planners ask for. Each is grown to the largest found in what is left
/// (IRIS, Deits and Tedrake 2014). Pieces below `min_area_m2` are not made, nor ones that all together could
/// add less than 2 % to the region, nor, but for the first, any narrower than d/4.
///
/// 1. All of a piece lies in the region, and no two overlap (checked in exact arithmetic).
/// 2. Parts of a region that do not hang together know nothing of one another: where one changes, the others'
///    pieces stay as they were, to the bit, though more or fewer may be made. Within a part, what changes its
///    largest piece may change all.
/// Some ms; O(corners of the region) for each of some dozen trials a piece.
std::vector<ConvexPiece> convex_pieces(const Surface& surface, const ContactRegion& region, std::size_t most,
                                       double min_area_m2 = 0);

}  // namespace octosurf
