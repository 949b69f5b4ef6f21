#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf {

/// What lies beyond a boundary edge of a surface.
enum class EdgeKind {
  real,          ///< the surface ends: free space or another object beyond the edge
  occluded,      ///< unknown, because an object in front of the surface blocked the view
  sensor_limit,  ///< unknown, because the sensor's range ended here
  frontier       ///< unknown for any other reason: not observed yet
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

/// One label for every edge of `surface.polygons`, ring by ring, from the octree within h beyond the edge and
/// the directions from which its inliers were seen. `surface` is one of the map's current snapshot; do not
/// insert during the call.
///
/// 1. An edge is sampled every d; the most frequent label wins, on a tie the first in the list above. An edge
///    shorter than 2 d between two of one other label takes that label.
/// 2. real: within h, a point off the plane or of another surface, or a free voxel behind the plane on the
///    line of sight, or straight behind a free one. Free space in front of a plane proves nothing.
/// 3. The sensor's position is known only to 4° and a fifth of its distance (payload.hpp).
/// 4. sensor_limit: that distance may have been the range limit, and the line of sight is free up to the
///    edge, as rays beyond the range leave it; or it may have been min_range. The limit is max_range; if that
///    is the sensor's own, 4 m, unless the surface has points seen from clearly farther (a lidar's: no
///    limit).
/// Deterministic. Cost: O(inliers) + 5 to 100 µs an edge, more where it is unknown; hence computed on request
/// only.
std::vector<PolygonEdges> label_edges(const Map& map, const Surface& surface);

}  // namespace octosurf
