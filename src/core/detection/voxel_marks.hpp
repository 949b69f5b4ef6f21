#pragma once

#include "occupancy/point_window.hpp"

#include <cstdint>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::detection {

/// A set of voxels, by block of 8³.
class VoxelMarks {
 public:
  /// Adds those within `reach` voxels of one along each axis.
  void add(geometry::VoxelKey key, int reach) {
    const auto [x, y, z] = occupancy::ints(key);
    add({{x - reach, y - reach, z - reach}, {x + reach, y + reach, z + reach}});
  }
  void add(const occupancy::KeyBox& box) {
    const auto [low, high] = box.cut({});
    for (int z = low[2] >> 3; z <= high[2] >> 3; ++z)
      for (int y = low[1] >> 3; y <= high[1] >> 3; ++y)
        for (int x = low[0] >> 3; x <= high[0] >> 3; ++x) {
          const occupancy::BlockPart part(low, high, {x, y, z});
          Slices& slices = slices_of(occupancy::key_of({x, y, z}).packed());
          for (unsigned k = part.first; k <= part.last; ++k) slices[k] |= part.slice;
        }
  }

  /// visit(PointId) for the points in them but not in `others`, block by block in the order of addition.
  template <class Visit>
  void for_each_point(const occupancy::PointWindow& window, const VoxelMarks& others, Visit&& visit) const {
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      Slices left = slices_[k];
      if (const auto at = others.index_.find(blocks_[k]); at != others.index_.end())
        for (std::size_t z = 0; z < left.size(); ++z) left[z] &= ~others.slices_[at->second][z];
      window.for_each_of_block(blocks_[k], left, visit);
    }
  }
  template <class Visit>
  void for_each_point(const occupancy::PointWindow& window, Visit&& visit) const {
    for_each_point(window, {}, visit);
  }

 private:
  using Slices = occupancy::PointWindow::Slices;
  Slices& slices_of(std::uint64_t block) {
    if (blocks_.empty() || blocks_[last_] != block) {  // added places mostly follow each other
      const auto [at, fresh] = index_.try_emplace(block, blocks_.size());
      last_ = at->second;
      if (fresh) {
        blocks_.push_back(block);
        slices_.emplace_back();
      }
    }
    return slices_[last_];
  }

  std::vector<std::uint64_t> blocks_;  // packed voxel keys divided by 8
  std::vector<Slices> slices_;
  std::size_t last_ = 0;
  tsl::robin_map<std::uint64_t, std::size_t, geometry::PackedKeyHash> index_;
};

}  // namespace octosurf::detection
