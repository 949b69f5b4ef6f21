#pragma once

#include "detection/readings.hpp"
#include "occupancy/key_box.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::detection {

/// The readings to be labelled by block of 8³ voxels and label: the surroundings of many readings are looked
/// up for a whole block, mostly with bit masks.
class LabelBlocks {
 public:
  using Index = Readings::Index;

  /// Readings of a block with one label.
  struct Group {
    Label label;
    std::array<std::uint64_t, 8> slices;  ///< slice z; bit 8·y + x
    std::vector<Index> members;           ///< ascending: by z, y, x
  };
  /// `wanted`: by reading; the others are skipped.
  LabelBlocks(const Readings& readings, const std::vector<Label>& labels, const std::vector<bool>& wanted);

  /// Those of a group in a box.
  static bool any_of(const Group& group, const occupancy::BlockPart& part) {
    std::uint64_t found = 0;
    for (unsigned z = part.first; z <= part.last; ++z) found |= group.slices[z] & part.slice;
    return found != 0;
  }
  /// visit(Index) for them, in order.
  template <class Visit>
  static void for_each_of(const Group& group, const occupancy::BlockPart& part, Visit&& visit) {
    const auto count = [](std::uint64_t bits) { return static_cast<std::size_t>(std::popcount(bits)); };
    std::size_t before = 0;
    for (unsigned z = 0; z <= part.last; before += count(group.slices[z++]))
      for (std::uint64_t left = z < part.first ? 0 : group.slices[z] & part.slice; left != 0;
           left &= left - 1)
        visit(group.members[before + count(group.slices[z] & ((left & -left) - 1))]);
  }
  struct Block {
    occupancy::Key3 place;  ///< voxels divided by 8
    std::vector<Group> groups;
    /// Its part within `reach` voxels of `key` along each axis.
    occupancy::BlockPart within(geometry::VoxelKey key, int reach) const {
      const auto [x, y, z] = occupancy::ints(key);
      return {{x - reach, y - reach, z - reach}, {x + reach, y + reach, z + reach}, place};
    }
  };
  /// Calls visit(group, blocks) for each group of which looks_around(group) is true, block by block in order,
  /// with the blocks that may have something within `reach` voxels of its readings, in order of z, y, x.
  /// Cost: blocks met.
  template <class LooksAround, class Visit>
  void for_each_group(int reach, LooksAround&& looks_around, Visit&& visit) const {
    for (const Block& block : blocks_)
      if (std::any_of(block.groups.begin(), block.groups.end(), looks_around)) {
        const std::vector<const Block*> around = near(block, reach);
        for (const Group& group : block.groups)
          if (looks_around(group)) visit(group, around);
      }
  }

 private:
  std::vector<const Block*> near(const Block& block, int reach) const;

  std::vector<Block> blocks_;  // in order of their readings
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> index_;
};

}  // namespace octosurf::detection
