// Takes over what another octree says of each voxel.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/voxel_tree.hpp"

#include <algorithm>
#include <limits>

namespace octosurf::occupancy {

template <class Policy>
void VoxelTree::replace(Slot& slot, const Theirs& theirs, int level, std::uint64_t morton, Policy& policy) {
  if (slot.link < first_link && theirs.slot.link < first_link) {
    const bool known = slot.link == leaf;
    slot = theirs.slot.link == leaf ? Slot{leaf, stated(known, slot.value, theirs.slot.value)} : Slot{};
    return;
  }
  if (level == brick_level) return replace_brick(slot, theirs, morton, policy);
  Group& children = divided(slot);
  for (unsigned c = 0; c < 8; ++c) {
    const Slot& child = theirs.slot.link < first_link ? theirs.slot : theirs.tree.group(theirs.slot)[c];
    replace(children[c], {theirs.tree, child}, level - 1, morton << 3 | c, policy);
  }
  if (std::ranges::all_of(children, [](const Slot& child) { return child.link == unknown; }))
    forget(slot, level);
  else
    close(slot);
}

template <class Policy>
void VoxelTree::replace_brick(Slot& slot, const Theirs& theirs, std::uint64_t brick_morton, Policy& policy) {
  const Brick* of = theirs.slot.link < first_link ? nullptr : &theirs.tree.brick(theirs.slot);
  const std::uint64_t known = of != nullptr ? of->known : theirs.slot.link == leaf ? whole : 0;
  Brick& b = brick_at(slot);
  for (unsigned i = 0; i < 64; ++i)
    if ((known >> i & 1) != 0)
      b.value[i] =
          stated((b.known >> i & 1) != 0, b.value[i], of != nullptr ? of->value[i] : theirs.slot.value);
    else
      b.value[i] = -std::numeric_limits<float>::infinity();  // its point vanishes
  b.known = known;
  if (b.points != 0) drop_vanished(b, brick_morton, b.points, policy);
  for (std::uint64_t m = ~known; m != 0; m &= m - 1) b.value[static_cast<unsigned>(std::countr_zero(m))] = 0;
  if (b.known == 0)
    forget(slot, brick_level);
  else
    close_brick(slot);
}

OccupancyDelta OccupancyMap::replace(const OccupancyMap& other) {
  struct Vanished {
    const geometry::VoxelGrid& grid;
    std::vector<VoxelPoint> points;
    void vanished(const VoxelPayload& payload, geometry::VoxelKey key) {
      points.push_back(point_of(payload, grid, key));
    }
  } policy{grid_, {}};
  tree_->replace(*other.tree_, policy);
  OccupancyDelta delta;
  delta.vanished = std::move(policy.points);
  delta.appeared = adopt_occupied_voxels();
  return delta;
}

}  // namespace octosurf::occupancy
