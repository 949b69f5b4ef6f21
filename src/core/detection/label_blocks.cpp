#include "detection/label_blocks.hpp"

#include <algorithm>

namespace octosurf::detection {
namespace {

void add_to_groups(std::vector<LabelBlocks::Group>& groups, Label label, geometry::VoxelKey key,
                   Readings::Index i) {
  auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.label == label; });
  if (group == groups.end()) group = groups.insert(group, {label, {}, {}});
  group->slices[key.z & 7] |= std::uint64_t{1} << (8 * (key.y & 7) + (key.x & 7));
  group->members.push_back(i);
}

}  // namespace

LabelBlocks::LabelBlocks(const Readings& readings, const std::vector<Label>& labels,
                         const std::vector<bool>& wanted) {
  for (Index i = 0; i < readings.size(); ++i) {
    const geometry::VoxelKey key = readings[i].key;
    const occupancy::Key3 place{key.x >> 3, key.y >> 3, key.z >> 3};
    if (blocks_.empty() || blocks_.back().place != place) {
      index_.emplace(occupancy::key_of(place).packed(), blocks_.size());
      blocks_.push_back({place, {}});
    }
    if (wanted[i]) add_to_groups(blocks_.back().groups, labels[i], key, i);
  }
}

std::vector<const LabelBlocks::Block*> LabelBlocks::near(const Block& block, int reach) const {
  const int blocks = (reach + 7) / 8;
  std::vector<const Block*> found;
  const auto [x, y, z] = block.place;
  for (int bz = z - blocks; bz <= z + blocks; ++bz)
    for (int by = y - blocks; by <= y + blocks; ++by)
      for (int bx = x - blocks; bx <= x + blocks; ++bx) {
        const auto at = index_.find(occupancy::key_of({bx, by, bz}).packed());
        if (at != index_.end() && !blocks_[at->second].groups.empty()) found.push_back(&blocks_[at->second]);
      }
  return found;
}

}  // namespace octosurf::detection
