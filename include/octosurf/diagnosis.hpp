#pragma once

#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Two surfaces where the world most likely has one: they face the same way and lie upon each other.
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
  double max_distance_m = 0.05;               ///< farther apart they are two things
  double min_overlap = 0.2;                   ///< share of the smaller surface's area
  /// Throws Error(usage) naming field, value and rule.
  void validate() const;
};

/// Pairs of surfaces that overlap though they are nearly parallel and near each other: what drifting
/// poses, noise or a wrong tolerance leave behind. Holes count: a board on a floor with a hole under it is
/// no double layer. Ascending by ids; the same snapshot gives the same answer.
/// Throws Error(usage) for options out of range. Cost O(n²) boxes, and for pairs whose boxes meet their
/// rings at rows d/2 apart: milliseconds for a room.
std::vector<DoubleLayer> double_layers(const Snapshot& snapshot, const DoubleLayerOptions& options = {});

}  // namespace octosurf
