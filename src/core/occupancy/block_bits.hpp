#pragma once

#include "occupancy/key_box.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

namespace octosurf::occupancy {

/// Maps the voxels of a box to bit addresses: the nine low bits are the Morton index inside a block of 8³
/// voxels (one cache line), the higher bits interleave the block's coordinates as far as the box extends
/// along each axis. Addresses wrap around, so the box may lie anywhere. To step along an axis, add with the
/// other axes' bits set to ones.
class BlockAddress {
 public:
  void fit(const KeyBox& box) {
    std::array<unsigned, 3> bits;
    for (std::size_t a = 0; a < 3; ++a) bits[a] = bits_for(box.low[a], box.high[a]);
    if (bits == bits_) return;
    bits_ = bits;
    mask = {0, 0, 0};
    unsigned place = 0;
    for (unsigned level = 0; level < 16; ++level)
      for (std::size_t a = 0; a < 3; ++a)
        if (level < bits[a]) mask[a] |= std::uint64_t{1} << place++;
    size_bits = place;
    for (std::size_t a = 0; a < 3; ++a) {
      table_[a].resize(std::size_t{1} << bits[a]);
      std::uint64_t spread = 0;
      for (std::uint64_t& entry : table_[a]) {
        entry = spread;
        spread = ((spread | ~mask[a]) + 1) & mask[a];
      }
    }
  }
  std::uint64_t of(unsigned x, unsigned y, unsigned z) const {
    return entry(0, x) | entry(1, y) | entry(2, z);
  }
  static unsigned bits_for(int min, int max) {
    const int span = (max | 7) - (min & ~7) + 1;
    unsigned bits = 5;  // a page of 32³ voxels takes its 15 low bits evenly from all axes
    while ((1 << bits) < span) ++bits;
    return bits;
  }

  std::array<std::uint64_t, 3> mask{};  ///< the bits of each axis
  unsigned size_bits = 0;               ///< 2^size_bits voxels

 private:
  std::uint64_t entry(std::size_t a, unsigned key) const { return table_[a][key & ((1U << bits_[a]) - 1)]; }

  std::array<unsigned, 3> bits_{};
  std::array<std::vector<std::uint64_t>, 3> table_;
};

/// Zeroed words; the system commits their memory on first write.
class LazyWords {
 public:
  /// Reuses the allocation if it is large enough, so callers must leave it zeroed.
  void reserve(std::size_t words) {
    if (words <= size_) return;
    words_.reset();
    size_ = 0;
    std::size_t space = words * sizeof(std::uint64_t) + 64;
    void* memory = std::calloc(space, 1);
    if (memory == nullptr) throw std::bad_alloc();
    words_.reset(memory);
    // A block is a cache line.
    aligned_ = static_cast<std::uint64_t*>(std::align(64, words * sizeof(std::uint64_t), memory, space));
    size_ = words;
  }
  std::uint64_t* data() const { return aligned_; }

 private:
  struct Free {
    void operator()(void* p) const { std::free(p); }
  };
  std::unique_ptr<void, Free> words_;
  std::uint64_t* aligned_ = nullptr;
  std::size_t size_ = 0;
};

/// A block outside the box, reached by few far rays: eight words of misses, eight of hits.
using StrayBlock = std::array<std::uint64_t, 16>;

}  // namespace octosurf::occupancy
