#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace octosurf::sensing {

/// Voxels of one scan, each with a number. Neighbouring points mostly share a cube of 4³ voxels, so the
/// table is one of cubes, each with the numbers of its 64 voxels, looked up only when a point
/// leaves the cube of the one before. Memory is kept from scan to scan. O(1) a call.
class VoxelTable {
 public:
  using Key = std::array<std::uint16_t, 3>;

  void clear() {
    if (slots_.empty()) slots_.resize(std::size_t{1} << 12);
    std::fill(slots_.begin(), slots_.end(), Slot{});
    used_ = 0;
    last_cube_ = empty;
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
    static constexpr Cube none{};
    if (slots_.empty()) return none;
    const Slot& slot = slots_[slot_of(cube_of(key))];
    return slot.cube == empty ? none : cubes_[slot.index];
  }

 private:
  static constexpr std::uint64_t empty = ~std::uint64_t{0};
  struct Slot {
    std::uint64_t cube = empty;
    std::uint32_t index = 0;
  };

  static std::uint64_t cube_of(const Key& k) {
    return std::uint64_t{k[0]} >> 2 | std::uint64_t{k[1]} >> 2 << 16 | std::uint64_t{k[2]} >> 2 << 32;
  }
  static std::size_t place_in_cube(const Key& k) {
    const auto spread = [](unsigned i) { return (i & 1U) | (i & 2U) << 2; };
    return spread(k[0]) | spread(k[1]) << 1 | spread(k[2]) << 2;
  }

  std::size_t slot_of(std::uint64_t cube) const {
    std::uint64_t h = cube * 0x9e3779b97f4a7c15ULL;  // Fibonacci hashing: the high bits are mixed best
    h ^= h >> 32;
    std::size_t i = h & (slots_.size() - 1);
    while (slots_[i].cube != cube && slots_[i].cube != empty) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  std::uint32_t make(std::uint64_t cube) {
    Slot& slot = slots_[slot_of(cube)];
    if (slot.cube == cube) return slot.index;
    const auto index = static_cast<std::uint32_t>(used_++);
    slot = {cube, index};
    if (used_ > cubes_.size())
      cubes_.emplace_back();
    else
      cubes_[index].fill(0);
    if (used_ * 2 > slots_.size()) grow();
    return index;
  }
  void grow() {
    std::vector<Slot> old(slots_.size() * 2);
    old.swap(slots_);
    for (const Slot& slot : old)
      if (slot.cube != empty) slots_[slot_of(slot.cube)] = slot;
  }

  std::vector<Slot> slots_;
  std::vector<Cube> cubes_;
  std::size_t used_ = 0;
  std::uint64_t last_cube_ = empty;  // of the previous call
  std::uint32_t last_index_ = 0;
};

}  // namespace octosurf::sensing
