#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf {

/// What lies beyond a boundary edge of a surface.
enum class EdgeKind {
  real,          ///< the surface ends: free space beyond it, or something else stands there
  occluded,      ///< unknown, because something off the surface stood between it and the sensor
  sensor_limit,  ///< unknown, because the sensor's range ended here
  frontier       ///< unknown for any other reason: nobody has looked
};
/// By EdgeKind.
inline constexpr std::array<std::string_view, 4> edge_kind_names{"real", "occluded", "sensor_limit",
                                                                 "frontier"};
/// As in files: "real", "occluded", …
constexpr std::string_view edge_kind_name(EdgeKind kind) {
  return edge_kind_names[static_cast<std::size_t>(kind)];
}

/// Labels of a polygon's edges; edge k of a ring runs from vertex k to k + 1.
struct PolygonEdges {
  std::vector<EdgeKind> outer;               ///< of the outer ring
  std::vector<std::vector<EdgeKind>> holes;  ///< of each hole's ring
};

/// One label for every edge of `surface.polygons`, ring by ring, from what the map's octree knows within h
/// beyond the edge and in line with where its inliers were seen from. `surface` is one of the map's present
/// snapshot; nothing may insert meanwhile.
///
/// 1. An edge asks every d along itself; the most frequent answer counts, on a tie the one named first above.
///    An edge shorter than 2 d between two of one other label takes theirs.
/// 2. real: within h, something off the plane or of another surface, or a free voxel behind the plane on the
///    line of sight, or straight behind a free one. Free space in front of a plane proves nothing.
/// 3. Where the sensor stood is known to 4° and to a fifth of its distance only (payload.hpp).
/// 4. sensor_limit: that distance may have been the range limit, and the line of sight is free up to
///    the edge, as rays beyond the range leave it; or it may have been min_range. The limit is max_range; if
///    that is the sensor's own, 4 m, unless the surface has points seen from clearly farther (a lidar's: no
///    limit).
/// Deterministic. Cost: O(inliers) + 5 to 100 µs an edge, more where it is unknown: taken when asked for.
std::vector<PolygonEdges> label_edges(const Map& map, const Surface& surface);

}  // namespace octosurf
