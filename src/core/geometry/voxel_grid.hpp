#pragma once

#include "geometry/voxel_key.hpp"

#include <Eigen/Core>
#include <algorithm>

namespace octosurf::geometry {

/// Conversion between coordinates and keys, in OctoMap's arithmetic, so that trees agree bit by bit.
class VoxelGrid {
 public:
  static constexpr int origin = 32768;         ///< key of the voxel that starts at coordinate 0
  static constexpr int last = 2 * origin - 1;  ///< highest key
  static int clamped(int key) { return std::clamp(key, 0, last); }

  explicit VoxelGrid(double resolution) : resolution_(resolution), per_metre_(1.0 / resolution) {}

  double resolution() const { return resolution_; }
  double per_metre() const { return per_metre_; }

  /// False if the point lies outside the octree's 2¹⁶ voxels an axis (or is not finite).
  bool key_of(const Eigen::Vector3f& p, VoxelKey& key) const {
    return axis_key(p.x(), key.x) && axis_key(p.y(), key.y) && axis_key(p.z(), key.z);
  }
  float centre_of(std::uint16_t k) const {
    return static_cast<float>((static_cast<double>(int{k} - origin) + 0.5) * resolution_);
  }
  Eigen::Vector3f centre_of(VoxelKey k) const { return {centre_of(k.x), centre_of(k.y), centre_of(k.z)}; }
  Eigen::Vector3d corner_of(VoxelKey k) const {
    return Eigen::Vector3d(int{k.x} - origin, int{k.y} - origin, int{k.z} - origin) * resolution_;
  }

 private:
  bool axis_key(double coordinate, std::uint16_t& key) const {
    const double scaled = per_metre_ * coordinate;
    if (!(scaled >= -origin && scaled < origin)) return false;
    int cell = static_cast<int>(scaled);
    cell -= (scaled < cell);  // floor() is a library call without SSE4.1
    key = static_cast<std::uint16_t>(cell + origin);
    return true;
  }

  double resolution_;
  double per_metre_;
};

}  // namespace octosurf::geometry
