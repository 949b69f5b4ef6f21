#pragma once

#include "surfaces/surface_store.hpp"

#include <cstddef>
#include <vector>

namespace octosurf::test {

/// Two surfaces that most likely represent one real face: the result of drifting poses, noise or a wrong
/// tolerance.
struct DoubleLayer {
  SurfaceId smaller = 0, larger = 0;
  std::size_t inliers = 0;  ///< of the smaller one, over or under inliers of the larger one
  double distance_m = 0;    ///< mean over these
};

/// Pairs that face the same way to 15°, so the two sides of a wall are none, and of which a fifth of the
/// smaller one's inliers lie within 5 cm of the larger one, whose holes count. O(inliers · log), about 1 µs
/// each.
std::vector<DoubleLayer> double_layers(const surfaces::SurfaceStore& surfaces);

}  // namespace octosurf::test
