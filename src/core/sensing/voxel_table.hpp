#pragma once

#include "geometry/voxel_key.hpp"

#include <array>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::sensing {

/// Voxels of one scan, each with a number. Neighbouring points mostly share a cube of 4³ voxels, so the
/// table is one of cubes, each with the numbers of its 64 voxels, looked up only when a point
/// leaves the cube of the one before. Memory is kept from scan to scan. O(1) a call.
class VoxelTable {
 public:
  using Key = std::array<std::uint16_t, 3>;

  void clear() {
    indices_.clear();
    last_cube_ = none;
  }

  /// The voxel's number; 0 until it is set.
  std::uint32_t& at(const Key& key) {
    if (const std::uint64_t cube = cube_of(key); cube != last_cube_) {
      last_cube_ = cube;
      last_index_ = make(cube);
    }
    return cubes_[last_index_][place_in_cube(key)];
  }
  std::uint32_t find(const Key& key) const { return numbers_near(key)[place_in_cube(key)]; }
  /// Of the cube that holds `key`, by Morton index.
  using Cube = std::array<std::uint32_t, 64>;
  const Cube& numbers_near(const Key& key) const {
    static constexpr Cube nothing{};
    const auto index = indices_.find(cube_of(key));
    return index == indices_.end() ? nothing : cubes_[index->second];
  }

 private:
  static constexpr std::uint64_t none = ~std::uint64_t{0};

  static std::uint64_t cube_of(const Key& k) {
    return std::uint64_t{k[0]} >> 2 | std::uint64_t{k[1]} >> 2 << 16 | std::uint64_t{k[2]} >> 2 << 32;
  }
  static std::size_t place_in_cube(const Key& k) {
    const auto spread = [](unsigned i) { return (i & 1U) | (i & 2U) << 2; };
    return spread(k[0]) | spread(k[1]) << 1 | spread(k[2]) << 2;
  }

  std::uint32_t make(std::uint64_t cube) {
    const auto [index, is_new] = indices_.try_emplace(cube, static_cast<std::uint32_t>(indices_.size()));
    if (is_new && index->second == cubes_.size())
      cubes_.emplace_back();
    else if (is_new)
      cubes_[index->second].fill(0);
    return index->second;
  }

  tsl::robin_map<std::uint64_t, std::uint32_t, geometry::PackedKeyHash> indices_;  // by cube
  std::vector<Cube> cubes_;
  std::uint64_t last_cube_ = none;  // of the previous call
  std::uint32_t last_index_ = 0;
};

}  // namespace octosurf::sensing
