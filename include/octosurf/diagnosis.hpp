#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Two surfaces that most likely represent one real surface: they face the same way and overlap.
struct DoubleLayer {
  SurfaceId first = 0;    ///< the lower of the two ids
  SurfaceId second = 0;   ///< the higher
  double overlap_m2 = 0;  ///< of their polygons where they are near each other
  double distance_m = 0;  ///< mean over the overlap, along the smaller one's normal
  double angle_rad = 0;   ///< between the planes
};

/// When two surfaces count as a double layer.
struct DoubleLayerOptions {
  double max_angle_rad = 0.2617993877991494;  ///< 15°; between normals, so the two sides of a wall are apart
  double max_distance_m = 0.05;               ///< greater distances mean two objects
  double min_overlap = 0.2;                   ///< share of the smaller surface's area
  /// Throws Error(usage) naming field, value and rule.
  void validate() const;
};

/// Pairs of surfaces that overlap while nearly parallel and close: the result of drifting poses, noise or a
/// wrong tolerance. Holes count: a board over a hole in the floor is no double layer. Ascending by ids;
/// deterministic. Throws Error(usage) for options out of range. Cost O(n²) boxes, and for pairs whose boxes
/// meet their rings at rows d/2 apart: milliseconds for a room.
std::vector<DoubleLayer> double_layers(const Snapshot& snapshot, const DoubleLayerOptions& options = {});

}  // namespace octosurf
