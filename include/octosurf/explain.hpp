#pragma once

#include <Eigen/Core>
#include <algorithm>
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

/// Why there is or is not a surface at a place. A new reason needs an entry here, its row in `reason_texts`,
/// and the code that returns it.
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

/// Text of a reason.
struct ReasonText {
  Reason reason;          ///< the reason
  std::string_view name;  ///< as in `--json`
  /// and {limit} are replaced by the figure's value and its lower bound, {surface} and {cylinder} by ids.
  std::string_view sentence;
  std::string_view figure{};  ///< name of the Figure; empty: none
  std::string_view unit{};    ///< of the Figure
};
/// By Reason.
inline constexpr std::array reason_texts{
    ReasonText{Reason::on_surface, "on_surface", "There is a surface here: surface {surface}."},
    ReasonText{Reason::in_hole, "in_hole", "No surface: this is in a hole of surface {surface}."},
    ReasonText{
        Reason::beside_surface, "beside_surface",
        "No surface: the nearest point belongs to surface {surface}, and this is outside its polygons."},
    ReasonText{Reason::on_cylinder, "on_cylinder", "No surface: this is on cylinder {cylinder}."},
    ReasonText{Reason::outside_map, "outside_map", "No surface: this is outside what the octree can hold."},
    ReasonText{Reason::unseen, "unseen", "No surface: nothing was ever seen here."},
    ReasonText{Reason::free_space, "free_space", "No surface: this is free space."},
    ReasonText{Reason::no_point, "no_point",
               "No surface: the voxel here is occupied, but no scan has put a point into it."},
    ReasonText{Reason::isolated, "isolated",
               "No surface: the point here stands alone, with fewer than two others within r."},
    ReasonText{Reason::too_few_points, "too_few_points",
               "No surface: only {measured} points on the plane here lie less than h apart, and a surface "
               "needs {limit}.",
               "points"},
    ReasonText{Reason::too_narrow, "too_narrow",
               "No surface: the patch here is {measured} m wide, and a surface needs {limit} m.", "width",
               "m"},
    ReasonText{Reason::edge_on, "edge_on",
               "No surface: the patch here was seen along its plane, at a mean cosine of {measured}; below "
               "{limit} its side is not known.",
               "cosine"},
    ReasonText{Reason::curved, "curved", "No surface: the patch here is curved, like a pillar's side."},
    ReasonText{Reason::seen_through, "seen_through",
               "No surface: what was seen here was seen through surface {surface} and is its noise."},
    ReasonText{Reason::no_plane, "no_plane",
               "No surface: no plane passes through the point here that enough others beside it agree on: an "
               "edge, something round, or clutter."},
    ReasonText{Reason::clutter, "clutter",
               "No surface: the plane through the points here explains less of what is seen around it than "
               "clutter does ({measured} nats, and a surface needs more than {limit}).",
               "explained", "nats"},
    ReasonText{Reason::waiting, "waiting",
               "Not yet a surface: a look around here would make one, but comes only once enough new points "
               "have."}};
/// Text of `reason`.
constexpr const ReasonText& text_of(Reason reason) {
  return reason_texts.at(static_cast<std::size_t>(reason));
}
static_assert(std::all_of(reason_texts.begin(), reason_texts.end(),
                          [](const ReasonText& text) { return &text_of(text.reason) == &text; }));

/// As in `--json`: "on_surface", "in_hole", …
constexpr std::string_view reason_name(Reason reason) { return text_of(reason).name; }

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
  /// Scans among the last 256, taken near enough to have seen the place, that were not inserted because their
  /// poses did not fit the map: their readings are missing. The sentence says so where it matters.
  std::size_t scans_left_out = 0;
  /// Likewise, scans inserted at their given pose although they did not fit: their readings may be doubled.
  std::size_t scans_unexplained = 0;
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
