#pragma once

#include "detection/readings.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::detection {

/// Readings by block of 8³ voxels and label: the surroundings of many readings are looked up for a whole
/// block, mostly with bit masks.
class LabelBlocks {
 public:
  using Index = Readings::Index;

  /// Readings of a block with one label, context or not.
  struct Group {
    Label label;
    bool context;
    std::array<std::uint64_t, 8> slices;  ///< slice z; bit 8·y + x
    std::vector<Index> members;           ///< ascending: by z, y, x
  };
  /// `wanted`: by reading; the others are skipped.
  LabelBlocks(const Readings& readings, const std::vector<Label>& labels, const std::vector<bool>& wanted);

  /// The part of a block inside a box.
  class BoxMask {
   public:
    bool empty() const { return slice_ == 0; }
    bool any_of(const Group& group) const {
      std::uint64_t found = 0;
      for (unsigned z = first_; z <= last_; ++z) found |= group.slices[z] & slice_;
      return found != 0;
    }
    /// visit(Index) for those of a group, in order.
    template <class Visit>
    void for_each_of(const Group& group, Visit&& visit) const {
      std::size_t before = 0;
      for (unsigned z = 0; z < first_; ++z) before += count(group.slices[z]);
      for (unsigned z = first_; z <= last_; ++z) {
        for (std::uint64_t left = group.slices[z] & slice_; left != 0; left &= left - 1) {
          const std::uint64_t below = (left & -left) - 1;
          visit(group.members[before + count(group.slices[z] & below)]);
        }
        before += count(group.slices[z]);
      }
    }

   private:
    friend LabelBlocks;
    static std::size_t count(std::uint64_t bits) { return static_cast<std::size_t>(std::popcount(bits)); }
    unsigned first_ = 0, last_ = 0;  // slices
    std::uint64_t slice_ = 0;        // mask within each slice
  };
  /// A block that may contain neighbours of another block's readings.
  struct Near {
    std::array<int, 3> corner;  ///< voxel
    const std::vector<Group>* groups;
    /// Within `reach` voxels of `key` along each axis.
    BoxMask within(geometry::VoxelKey key, int reach) const;
  };
  /// Calls visit(group, blocks) for each group of which looks_around(group) is true, block by block in order,
  /// with the blocks that may have something within `reach` voxels of its readings, in order of z, y, x.
  /// Cost: blocks met.
  template <class LooksAround, class Visit>
  void for_each_group(int reach, LooksAround&& looks_around, Visit&& visit) const {
    for (const Block& block : blocks_)
      if (std::any_of(block.groups.begin(), block.groups.end(), looks_around)) {
        const std::vector<Near> around = near(block, reach);
        for (const Group& group : block.groups)
          if (looks_around(group)) visit(group, around);
      }
  }

 private:
  struct Block {
    std::array<int, 3> place;  // voxel key divided by 8
    std::vector<Group> groups;
  };
  static std::uint64_t packed(int x, int y, int z);
  std::vector<Near> near(const Block& block, int reach) const;

  std::vector<Block> blocks_;
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> index_;
};

}  // namespace octosurf::detection
