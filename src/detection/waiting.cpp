#include "detection/waiting.hpp"

#include "detection/constants.hpp"
#include "detection/planelets.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <iterator>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

namespace octosurf::detection {
namespace {

using Index = surfaces::MapView::Index;
using geometry::VoxelKey;

using Keys = tsl::robin_set<std::uint64_t, geometry::PackedKeyHash>;

/// Takes those out of `before` that lie in the same largest blocks of planelets as something new.
std::vector<VoxelKey> take_around(std::vector<VoxelKey>& before, std::span<const VoxelKey> fresh, int edge) {
  const VoxelBlocks blocks(edge << (planelet_levels - 1));
  Keys places;
  for (const VoxelKey key : fresh) places.insert(blocks.of(key));
  std::vector<VoxelKey> around;
  std::erase_if(before, [&](VoxelKey key) {
    if (!places.contains(blocks.of(key))) return false;
    around.push_back(key);
    return true;
  });
  return around;
}

std::vector<VoxelKey> united(const std::vector<VoxelKey>& a, std::span<const VoxelKey> b) {
  std::vector<VoxelKey> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

/// Adds to `due` what of these blocks is, but for what is taken.
void add_due(const surfaces::MapView& map, const VoxelBlocks& blocks, std::span<const VoxelKey> fresh,
             const std::vector<VoxelKey>& waiting, const Keys& taken, Keys& due) {
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> come;  // since segmented last
  for (const VoxelKey key : fresh)
    if (!due.contains(key.packed())) come.try_emplace(blocks.of(key), 0);
  for (const VoxelKey key : waiting)
    if (const auto at = come.find(blocks.of(key)); at != come.end() && !due.contains(key.packed()))
      ++at.value();
  for (const VoxelKey key : fresh) {
    const auto at = come.find(blocks.of(key));
    if (at == come.end() || at->second < Constants::fewest_of_plane) continue;
    std::vector<VoxelKey> pending;
    blocks.for_each_point(map.window, at->first, [&](Index i) {
      const occupancy::VoxelPoint& p = map.window[i];
      if (p.surface == 0 && !due.contains(p.key.packed()) && !taken.contains(p.key.packed()))
        pending.push_back(p.key);
    });
    if (2 * at->second >= pending.size())
      for (const VoxelKey p : pending) due.insert(p.packed());
    come.erase(at);  // it is looked at once
  }
}

/// The blocks in which what is due holds a plane of its own.
Keys blocks_with_planes(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                        const VoxelBlocks& blocks, const std::vector<VoxelKey>& due) {
  const Readings readings(octree, map.window, {.voxels = due, .may_join = {}, .context = {}, .rims = {}},
                          map.noise);
  Segmentation planelets;
  planelets.labels.assign(readings.size(), clutter);
  find_planelets(readings, planelets);
  Keys places;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (planelets.labels[i] != clutter) places.insert(blocks.of(readings[i].key));
  return places;
}

}  // namespace

Waiting due_to_segment(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                       std::vector<VoxelKey> before, std::span<const VoxelKey> fresh,
                       std::vector<Assignment>& expanded) {
  const int edge = planelet_edge(map.grid.resolution());
  Keys taken, due;
  for (const Assignment& assignment : expanded) taken.insert(map.window[assignment.point].key.packed());
  const auto waits = [&](VoxelKey key) { return map.is_pending(key) && !taken.contains(key.packed()); };
  std::vector<VoxelKey> left, around = take_around(before, fresh, edge);
  std::copy_if(fresh.begin(), fresh.end(), std::back_inserter(left), waits);
  std::erase_if(around, [&](VoxelKey key) { return !waits(key); });
  around = united(around, left);
  for (int level = 0; level < planelet_levels; ++level)
    add_due(map, VoxelBlocks(edge << level), left, around, taken, due);
  std::erase_if(around, [&](VoxelKey key) { return due.contains(key.packed()); });
  Waiting result{.due = {}, .left = united(before, around)};
  for (const std::uint64_t key : due) result.due.push_back(VoxelKey::unpack(key));
  const VoxelBlocks blocks(edge);
  const Keys with_planes = blocks_with_planes(map, octree, blocks, result.due);
  std::erase_if(expanded, [&](const Assignment& assignment) {
    const VoxelKey key = map.window[assignment.point].key;
    if (!with_planes.contains(blocks.of(key))) return false;
    result.due.push_back(key);
    return true;
  });
  std::sort(result.due.begin(), result.due.end());
  return result;
}

std::vector<VoxelKey> waiting_on(std::span<const VoxelKey> too_few) {
  std::vector<VoxelKey> some;
  for (std::size_t i = 0; i < too_few.size(); ++i)
    if (2 * i % 5 < 2) some.push_back(too_few[i]);
  return some;
}

}  // namespace octosurf::detection
