#include "detection/label_blocks.hpp"

#include <algorithm>

namespace octosurf::detection {
namespace {

std::array<int, 3> place_of(geometry::VoxelKey key) { return {key.x >> 3, key.y >> 3, key.z >> 3}; }

void add_to_groups(std::vector<LabelBlocks::Group>& groups, Label label, bool context, geometry::VoxelKey key,
                   Readings::Index i) {
  auto group = std::find_if(groups.begin(), groups.end(), [&](const LabelBlocks::Group& g) {
    return g.label == label && g.context == context;
  });
  if (group == groups.end()) group = groups.insert(group, {label, context, {}, {}});
  group->slices[key.z & 7] |= std::uint64_t{1} << (8 * (key.y & 7) + (key.x & 7));
  group->members.push_back(i);
}

}  // namespace

LabelBlocks::LabelBlocks(const Readings& readings, const std::vector<Label>& labels,
                         const std::vector<bool>& wanted) {
  std::size_t at = 0;  // block of the last one: readings of a block are consecutive, and so is its context
  for (Index i = 0; i < readings.size_with_context(); ++i) {
    const geometry::VoxelKey key = readings[i].key;
    const std::array<int, 3> place = place_of(key);
    if (blocks_.empty() || blocks_[at].place != place) {
      const auto [entry, fresh] = index_.try_emplace(packed(place[0], place[1], place[2]), blocks_.size());
      at = entry->second;
      if (fresh) blocks_.push_back({place, {}});
    }
    if (wanted[i]) add_to_groups(blocks_[at].groups, labels[i], readings.is_context(i), key, i);
  }
}

std::uint64_t LabelBlocks::packed(int x, int y, int z) {
  return geometry::VoxelKey{static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                            static_cast<std::uint16_t>(z)}
      .packed();
}

std::vector<LabelBlocks::Near> LabelBlocks::near(const Block& block, int reach) const {
  const int blocks = (reach + 7) / 8;
  std::vector<Near> found;
  const auto [x, y, z] = block.place;
  for (int bz = z - blocks; bz <= z + blocks; ++bz)
    for (int by = y - blocks; by <= y + blocks; ++by)
      for (int bx = x - blocks; bx <= x + blocks; ++bx) {
        const auto at = index_.find(packed(bx, by, bz));
        if (at == index_.end() || blocks_[at->second].groups.empty()) continue;
        found.push_back({{8 * bx, 8 * by, 8 * bz}, &blocks_[at->second].groups});
      }
  return found;
}

LabelBlocks::BoxMask LabelBlocks::Near::within(geometry::VoxelKey key, int reach) const {
  const std::array<int, 3> middle{key.x, key.y, key.z};
  std::array<unsigned, 3> low, high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int from = middle[axis] - reach - corner[axis], to = middle[axis] + reach - corner[axis];
    if (from > 7 || to < 0) return {};
    low[axis] = static_cast<unsigned>(std::max(0, from));
    high[axis] = static_cast<unsigned>(std::min(7, to));
  }
  const std::uint64_t row = (0xffU >> (7 - high[0] + low[0])) << low[0];
  BoxMask part;
  part.first_ = low[2];
  part.last_ = high[2];
  part.slice_ = (row * 0x0101010101010101ULL & (~0ULL >> (8 * (7 - high[1] + low[1])))) << (8 * low[1]);
  return part;
}

}  // namespace octosurf::detection
