#include "detection/waiting.hpp"

#include "detection/constants.hpp"
#include "detection/seed_patches.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tsl/robin_map.h>
#include <tuple>

namespace octosurf::detection {
namespace {

using geometry::VoxelKey;
using occupancy::PointSet;

/// Adds the pending points of these blocks to `due`. `come`: points that came since the last segmentation.
void add_due(const surfaces::MapView& map, const VoxelBlocks& blocks, std::span<const PointId> come,
             std::size_t fewest, PointSet& in_due, std::vector<PointId>& due) {
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> counts;
  for (const PointId i : come)
    if (!in_due.contains(i)) ++counts[blocks.of(map.window[i].key)];
  for (const auto& [place, count] : counts) {
    if (count < fewest) continue;
    std::vector<PointId> pending;
    const auto may_be_due = [&] { return pending.size() <= 2 * count; };
    blocks.for_each_point_while(map.window, place, may_be_due, [&](PointId i) {
      if (map.window[i].surface == 0 && !in_due.contains(i)) pending.push_back(i);
    });
    if (2 * count < pending.size()) continue;
    for (const PointId i : pending) in_due.insert(i);
    due.insert(due.end(), pending.begin(), pending.end());
  }
}

struct WaitingBlock {
  VoxelKey cell;               // one in it
  std::vector<VoxelKey> come;  // cells of its new points
  bool waits = true;
};

/// The largest blocks of seed patches with pending points, oldest first.
class WaitingBlocks {
 public:
  explicit WaitingBlocks(int edge) : blocks_(edge) {}

  void add(VoxelKey cell) {
    if (places_.try_emplace(blocks_.of(cell), all.size()).second) all.push_back({cell, {}});
  }
  WaitingBlock* find(VoxelKey cell) {
    const auto at = places_.find(blocks_.of(cell));
    return at == places_.end() ? nullptr : &all[at->second];
  }
  VoxelKey place_of(const WaitingBlock& block) const { return VoxelKey::unpack(blocks_.of(block.cell)); }

  std::vector<WaitingBlock> all;

 private:
  VoxelBlocks blocks_;
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> places_;
};

/// Each block that has a surface is looked at in one of three scans: more new points at a time cost less
/// each.
bool has_turn(const surfaces::MapView& map, VoxelKey place, VoxelKey cell, std::uint64_t turn) {
  constexpr std::uint64_t turns = 3;
  return (place.x + place.y + place.z + turn) % turns == 0 ||
         map.surfaces.in_regions_near(map.first_voxel_of(cell), 0).empty();
}

/// At least a quarter: after eight scans a tenth of a backlog is left, however large.
std::size_t budget_of(const Parameters& parameters, std::size_t waiting) {
  const auto least = static_cast<std::size_t>(parameters.detection.detection_budget);
  return least == 0 ? std::numeric_limits<std::size_t>::max() : std::max(least, waiting / 4);
}

/// Cuts to `most` points, in whole, adjacent blocks of seed patches; if `some`, at least one of these.
void cut_to(const surfaces::MapView& map, std::size_t most, bool some, int edge,
            std::vector<PointId>& points) {
  const auto nested = [&](PointId i) {
    const VoxelKey key = map.window[i].key;
    return std::tuple(VoxelBlocks(4 * edge).of(key), VoxelBlocks(2 * edge).of(key),
                      VoxelBlocks(edge).of(key));
  };
  std::sort(points.begin(), points.end(), [&](PointId a, PointId b) {
    return std::tuple(nested(a), map.window[a].key) < std::tuple(nested(b), map.window[b].key);
  });
  const auto within_block = [&](std::size_t k) { return nested(points[k]) == nested(points[k - 1]); };
  std::size_t end = most;
  while (end > 0 && within_block(end)) --end;
  if (end == 0 && some)
    for (end = std::max<std::size_t>(most, 1); end < points.size() && within_block(end);) ++end;
  points.resize(end);
}

/// The pending cells more than half of whose pending points are new. `keys`: the cell of each new point.
std::vector<PointId> new_cells(const surfaces::MapView& map, std::span<const VoxelKey> keys) {
  std::vector<PointId> points, come;
  for (const VoxelKey key : keys)
    if (const PointId i = map.window.find(key); map.is_pending(i)) points.push_back(i);
  std::sort(points.begin(), points.end());
  for (auto at = points.begin(); at != points.end();) {
    const auto next = std::find_if(at, points.end(), [&](PointId i) { return i != *at; });
    if (2 * static_cast<std::size_t>(next - at) > map.cells.pending_in(*at)) come.push_back(*at);
    at = next;
  }
  return come;
}

/// The pending cells of a block's blocks of each size in which enough is new.
std::vector<PointId> due_of(const surfaces::MapView& map, int edge, const WaitingBlock& block,
                            PointSet& in_due) {
  const std::size_t fewest =
      std::max(Constants::fewest_of_plane,
               static_cast<std::size_t>(map.parameters.min_surface_points()) / Constants::looks);
  const std::vector<PointId> come = new_cells(map, block.come);
  std::vector<PointId> due;
  for (int level = 0; level < seed_patch_levels; ++level)
    add_due(map, VoxelBlocks(edge << level), come, fewest, in_due, due);
  return due;
}

}  // namespace

Due due_to_segment(const surfaces::MapView& voxels, const surfaces::PendingQueue& before,
                   std::span<const PointId> fresh, std::optional<std::uint64_t> turn) {
  const surfaces::MapView& map = voxels.cells.map();
  const int edge = seed_patch_edge(map.grid.resolution());
  WaitingBlocks queue(edge << (seed_patch_levels - 1));
  std::vector<VoxelKey> fresh_keys;
  for (const VoxelKey key : before.blocks) queue.add(map.cell_of(key));
  for (const PointId i : fresh) {
    fresh_keys.push_back(voxels.window[i].key);
    if (voxels.is_pending(i)) queue.add(map.cell_of(fresh_keys.back()));
  }
  Due result;
  std::set_union(before.fresh.begin(), before.fresh.end(), fresh_keys.begin(), fresh_keys.end(),
                 std::back_inserter(result.left.fresh));
  std::size_t come = 0;
  for (const VoxelKey key : result.left.fresh)
    if (WaitingBlock* block = queue.find(map.cell_of(key))) {
      block->come.push_back(map.cell_of(key));
      ++come;
    }
  const std::size_t budget = turn ? budget_of(map.parameters, come) : std::numeric_limits<std::size_t>::max();
  const bool in_turns = turn && map.parameters.detection.detection_budget > 0;
  std::vector<PointId> cells;  // due
  PointSet in_due;
  bool over = false;
  for (WaitingBlock& block : queue.all) {
    block.waits = over || cells.size() >= budget ||
                  (in_turns && !has_turn(map, queue.place_of(block), block.cell, *turn));
    if (!block.waits) {
      std::vector<PointId> points = due_of(map, edge, block, in_due);
      over = points.size() > budget - cells.size();
      if (over) cut_to(map, budget - cells.size(), cells.empty(), edge, points);
      cells.insert(cells.end(), points.begin(), points.end());
    }
    if (!block.waits && !over) continue;
    result.left.blocks.push_back(map.first_voxel_of(block.cell));
    result.waiting += block.come.size();
  }
  const PointSet due(cells);
  std::erase_if(result.left.fresh, [&](VoxelKey key) {
    const WaitingBlock* block = queue.find(map.cell_of(key));
    if (block == nullptr || block->waits) return false;
    const PointId i = map.find(key);
    return !map.is_pending(i) || due.contains(i);
  });
  result.points = map.cells.pending_in(cells);
  return result;
}

std::vector<PointId> waiting_on(std::span<const PointId> too_few) {
  std::vector<PointId> some;
  for (std::size_t i = 0; i < too_few.size(); ++i)
    if (2 * i % 5 < 2) some.push_back(too_few[i]);
  return some;
}

}  // namespace octosurf::detection
