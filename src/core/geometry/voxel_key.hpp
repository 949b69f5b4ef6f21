#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace octosurf::geometry {

/// Discrete address of a voxel, as OctoMap's OcTreeKey: voxel k spans [(k−2¹⁵)·d, (k+1−2¹⁵)·d).
struct VoxelKey {
  std::uint16_t x = 0, y = 0, z = 0;

  std::uint64_t packed() const {
    return (std::uint64_t{z} << 32) | (std::uint64_t{y} << 16) | std::uint64_t{x};
  }
  static VoxelKey unpack(std::uint64_t p) {
    return {static_cast<std::uint16_t>(p), static_cast<std::uint16_t>(p >> 16),
            static_cast<std::uint16_t>(p >> 32)};
  }
  friend bool operator==(const VoxelKey&, const VoxelKey&) = default;
  /// Order by z, then y, then x: the order of all sorted results.
  friend bool operator<(const VoxelKey& a, const VoxelKey& b) { return a.packed() < b.packed(); }
};

using VoxelStep = std::array<int, 3>;
/// To the six voxels that share a face with one.
inline constexpr std::array<VoxelStep, 6> face_steps{
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
/// Keys wrap at the borders of the grid.
constexpr VoxelKey stepped(VoxelKey k, const VoxelStep& step) {
  return {static_cast<std::uint16_t>(k.x + step[0]), static_cast<std::uint16_t>(k.y + step[1]),
          static_cast<std::uint16_t>(k.z + step[2])};
}

/// Of a cell of some grid, whose coordinates are below 2²⁰ in size.
inline std::uint64_t packed_cell(const Eigen::Vector3i& cell) {
  const auto part = [](int v) { return static_cast<std::uint64_t>(v) & 0x1fffff; };
  return part(cell.x()) << 42 | part(cell.y()) << 21 | part(cell.z());
}

/// Spreads the bits of packed keys over a hash table (the finaliser of splitmix64).
struct PackedKeyHash {
  std::size_t operator()(std::uint64_t k) const {
    k ^= k >> 30;
    k *= 0xbf58476d1ce4e5b9ULL;
    k ^= k >> 27;
    k *= 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(k ^ (k >> 31));
  }
};

}  // namespace octosurf::geometry
