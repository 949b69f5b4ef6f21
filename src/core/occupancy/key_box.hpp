#pragma once

#include "geometry/morton.hpp"
#include "geometry/voxel_grid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <octosurf/error.hpp>

namespace octosurf::occupancy {

/// A voxel's key as signed numbers, which may be outside the octree.
using Key3 = std::array<int, 3>;

using geometry::VoxelGrid;

inline double centre_of(int key, double resolution) { return (key - VoxelGrid::origin + 0.5) * resolution; }
inline Eigen::Vector3d centre_of(const Key3& key, double resolution) {
  return {centre_of(key[0], resolution), centre_of(key[1], resolution), centre_of(key[2], resolution)};
}
inline Key3 ints(geometry::VoxelKey key) { return {key.x, key.y, key.z}; }
inline geometry::VoxelKey key_of(const Key3& key) {
  return {static_cast<std::uint16_t>(key[0]), static_cast<std::uint16_t>(key[1]),
          static_cast<std::uint16_t>(key[2])};
}
inline std::array<std::uint16_t, 3> corner_of(const Key3& key) {
  const auto [x, y, z] = key_of(key);
  return {x, y, z};
}

/// A box of voxels, both ends included; empty if an end precedes its beginning.
struct KeyBox {
  Key3 low{0, 0, 0}, high{VoxelGrid::last, VoxelGrid::last, VoxelGrid::last};

  static KeyBox cube(const Key3& corner, int level) {
    const int edge = (1 << level) - 1;
    return {corner, {corner[0] + edge, corner[1] + edge, corner[2] + edge}};
  }
  KeyBox cut(const KeyBox& other) const {
    KeyBox result;
    for (std::size_t i = 0; i < 3; ++i) {
      result.low[i] = std::max(low[i], other.low[i]);
      result.high[i] = std::min(high[i], other.high[i]);
    }
    return result;
  }
  std::size_t voxels() const {
    std::size_t product = 1;
    for (std::size_t i = 0; i < 3; ++i)
      product *= static_cast<std::size_t>(std::max(0, high[i] - low[i] + 1));
    return product;
  }
  /// Neither may be empty.
  bool meets(const KeyBox& other) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (other.low[i] > high[i] || other.high[i] < low[i]) return false;
    return true;
  }
  bool holds(const KeyBox& other) const { return holds(other.low) && holds(other.high); }
  template <class Key>  // Key3, or OctoMap's
  bool holds(const std::array<Key, 3>& key) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (key[i] < low[i] || key[i] > high[i]) return false;
    return true;
  }
};

/// The part in a box of a block of 8³ voxels: slices z, and the bits 8·y + x of each.
struct BlockPart {
  unsigned first = 0, last = 0;  ///< slices
  std::uint64_t slice = 0;       ///< none: the box does not meet the block

  /// `block`: its place, voxels divided by 8. Both ends of the box are included.
  BlockPart(const Key3& low, const Key3& high, const Key3& block) {
    std::array<unsigned, 3> from, to;
    for (std::size_t i = 0; i < 3; ++i) {
      if (low[i] > 8 * block[i] + 7 || high[i] < 8 * block[i]) return;
      from[i] = static_cast<unsigned>(std::max(low[i] - 8 * block[i], 0));
      to[i] = static_cast<unsigned>(std::min(high[i] - 8 * block[i], 7));
    }
    first = from[2];
    last = to[2];
    const std::uint64_t row = 0xffU >> (7 - to[0] + from[0]) << from[0];
    slice = row * 0x0101010101010101ULL & ~0ULL >> 8 * (7 - to[1] + from[1]) << 8 * from[1];
  }
};

/// Throws Error(usage).
inline void require_box(const Eigen::AlignedBox3d& box) {
  if (box.min().hasNaN() || box.max().hasNaN()) throw Error(Error::Kind::usage, "box", "is not a number");
}

/// The voxels whose centres lie in a closed box.
inline KeyBox keys_in(const Eigen::AlignedBox3d& box, double resolution) {
  KeyBox keys;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const auto near = [&](double coordinate) {
      const double key = coordinate / resolution + VoxelGrid::origin - 0.5;
      return static_cast<int>(std::clamp(std::nearbyint(key), -1.0, VoxelGrid::last + 1.0));
    };
    // The division may round across a centre, so the centres are compared themselves.
    int low = near(box.min()[axis]), high = near(box.max()[axis]);
    if (centre_of(low, resolution) < box.min()[axis]) ++low;
    if (centre_of(high, resolution) > box.max()[axis]) --high;
    keys.low[i] = std::max(0, low);
    keys.high[i] = std::min(VoxelGrid::last, high);
  }
  return keys;
}

/// The voxels that meet a closed box.
inline KeyBox keys_that_meet(const Eigen::AlignedBox3d& box, double resolution) {
  KeyBox keys;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const auto key = [&](double coordinate) {
      return static_cast<int>(
          std::clamp(std::floor(coordinate / resolution) + VoxelGrid::origin, -1.0, VoxelGrid::last + 1.0));
    };
    keys.low[i] = key(box.min()[axis]);
    keys.high[i] = key(box.max()[axis]);
  }
  return keys;
}

inline Key3 child_corner(const Key3& corner, unsigned c, int level) {
  return {corner[0] + static_cast<int>((c & 1) << level), corner[1] + static_cast<int>((c >> 1 & 1) << level),
          corner[2] + static_cast<int>((c >> 2 & 1) << level)};
}

inline std::uint64_t morton_of(const Key3& key) {
  return geometry::morton_of(static_cast<unsigned>(key[0]), static_cast<unsigned>(key[1]),
                             static_cast<unsigned>(key[2]));
}

}  // namespace octosurf::occupancy
