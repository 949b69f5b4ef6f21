#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::detection {
class Detector;
}  // namespace octosurf::detection

namespace octosurf {

/// Why there is or is not a surface at a place.
enum class Reason {
  on_surface,      ///< the place lies within a surface's polygons
  in_hole,         ///< in a hole of a surface
  beside_surface,  ///< the nearest point belongs to a surface, but the place is outside its polygons
  on_cylinder,     ///< the nearest point is pending and supports a cylinder
  outside_map,     ///< beyond the octree's 2¹⁶ voxels
  unseen,          ///< no ray reached it
  free_space,      ///< rays passed through
  no_point,        ///< occupied, but without a point from a scan (an OctoMap before detection)
  isolated,        ///< fewer than two pending neighbours within r
  too_few_points,  ///< fewer than n connected points on one plane
  too_narrow,      ///< narrower than min_surface_width
  edge_on,         ///< seen too nearly along the plane to know from which side
  curved,          ///< a curved patch, such as a pillar's
  seen_through,    ///< seen through a surface: noise of that surface
  no_plane,        ///< no plane through it fits five points of one component
  clutter,         ///< a plane here explains too little of its surroundings
  waiting          ///< the next detection here would create a surface
};

/// By Reason, as in `--json`.
inline constexpr std::array<std::string_view, 17> reason_names{
    "on_surface", "in_hole",      "beside_surface", "on_cylinder",    "outside_map", "unseen",
    "free_space", "no_point",     "isolated",       "too_few_points", "too_narrow",  "edge_on",
    "curved",     "seen_through", "no_plane",       "clutter",        "waiting"};
/// "on_surface", "in_hole", …
constexpr std::string_view reason_name(Reason reason) {
  return reason_names[static_cast<std::size_t>(reason)];
}

/// A number behind an explanation, and its bound, if there is one.
struct Figure {
  std::string name;                ///< e.g. "width"
  double value = 0;                ///< in `unit`
  std::string unit;                ///< "" for counts and shares
  std::optional<double> at_least;  ///< lower bound; empty: none
};

/// Result of explain().
struct Explanation {
  Reason reason = Reason::unseen;            ///< why, or on_surface and its like
  std::string sentence;                      ///< plain English, one line
  Eigen::Vector3d asked{0, 0, 0};            ///< the queried place, map frame
  std::optional<Eigen::Vector3d> looked_at;  ///< the nearest point within h, if there is one
  SurfaceId surface = 0;                     ///< the surface concerned; 0: none
  CylinderId cylinder = 0;                   ///< that the point supports; 0: none
  SurfaceId nearest = 0;                     ///< surface with the nearest inlier; 0: no surfaces
  double nearest_distance = 0;               ///< m, to that inlier
  std::vector<Figure> figures;               ///< numbers behind the reason
  /// For a pending point: the reasons of the pending points within h, with their counts.
  std::map<Reason, std::size_t> around;
};

/// Explains why there is no surface at `point` (map frame). Takes the nearest occupied voxel's point within
/// h; if it is pending, repeats detection among the points around it and reports the check that rejected it.
/// The map does not change; do not insert during the call.
///
/// Cost: O(inliers), and for a pending point 5 µs for each point around it, by the paper's detector 20 µs.
/// `paper`: as for Mapper. Throws Error(usage) if `point` is not finite, or if the point is pending and the
/// map's detector is missing.
Explanation explain(const Map& map, const Eigen::Vector3d& point, const detection::Detector* paper = nullptr);

}  // namespace octosurf
