#pragma once

#include <cstddef>

namespace octosurf {

/// How samples of a scan agree with what the octree held before it, at the scan's pose in the map.
struct Agreement {
  std::size_t agrees = 0;         ///< an occupied voxel is within the noise
  std::size_t in_free_space = 0;  ///< none is, and at least three rays went through there
  std::size_t behind_matter = 0;  ///< neither, but the ray passes through a voxel hit at least three times

  std::size_t compared() const { return agrees + in_free_space + behind_matter; }  ///< the rest is new
  /// Of what was compared, [0, 1]; 1 if nothing was.
  double share() const {
    return compared() > 0 ? static_cast<double>(agrees) / static_cast<double>(compared()) : 1;
  }
};

}  // namespace octosurf
