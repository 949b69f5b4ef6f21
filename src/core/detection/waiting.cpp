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
    blocks.for_each_point(map.window, place, [&](PointId i) {
      if (map.window[i].surface == 0 && !in_due.contains(i)) pending.push_back(i);
    });
    if (2 * count < pending.size()) continue;
    for (const PointId i : pending) in_due.insert(i);
    due.insert(due.end(), pending.begin(), pending.end());
  }
}

/// The queue of waiting blocks with the new points of each.
class BlockQueue {
 public:
  /// `come`: new points of any block.
  BlockQueue(const VoxelBlocks& blocks, std::span<const VoxelKey> order, std::span<const VoxelKey> come)
      : blocks_(blocks) {
    for (const VoxelKey key : order)
      if (at_.try_emplace(blocks.of(key), order_.size()).second) order_.push_back(key);
    begins_.assign(order_.size() + 1, 0);
    std::vector<std::size_t> at(come.size());
    for (std::size_t k = 0; k < come.size(); ++k)
      if ((at[k] = place_of(come[k])) < order_.size()) ++begins_[at[k] + 1];
    for (std::size_t b = 0; b < order_.size(); ++b) begins_[b + 1] += begins_[b];
    come_.resize(begins_.back());
    std::vector<std::size_t> next(begins_.begin(), begins_.end());
    for (std::size_t k = 0; k < come.size(); ++k)
      if (at[k] < order_.size()) come_[next[at[k]]++] = come[k];
  }

  std::size_t size() const { return order_.size(); }
  std::size_t points() const { return come_.size(); }
  std::size_t points_from(std::size_t turn) const { return come_.size() - begins_[turn]; }
  std::span<const VoxelKey> points_of(std::size_t turn) const {
    return std::span(come_).subspan(begins_[turn], begins_[turn + 1] - begins_[turn]);
  }
  /// size(): not in a waiting block.
  std::size_t place_of(VoxelKey key) const {
    const auto found = at_.find(blocks_.of(key));
    return found == at_.end() ? order_.size() : found->second;
  }
  std::vector<VoxelKey> order_from(std::size_t turn) const {
    return {order_.begin() + static_cast<std::ptrdiff_t>(turn), order_.end()};
  }

 private:
  const VoxelBlocks& blocks_;
  std::vector<VoxelKey> order_;  // one of each block
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> at_;
  std::vector<std::size_t> begins_;
  std::vector<VoxelKey> come_;  // block after block
};

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

}  // namespace

Due due_to_segment(const surfaces::MapView& map, const surfaces::PendingQueue& before,
                   std::span<const PointId> fresh, bool all) {
  const int edge = seed_patch_edge(map.grid.resolution());
  const VoxelBlocks largest(edge << (seed_patch_levels - 1));
  const auto waits = [&](PointId i) { return i != PointId::none && map.window[i].surface == 0; };
  std::vector<VoxelKey> fresh_keys, order = before.blocks;
  for (const PointId i : fresh) {
    fresh_keys.push_back(map.window[i].key);
    if (waits(i)) order.push_back(map.window[i].key);
  }
  Due result;
  std::set_union(before.fresh.begin(), before.fresh.end(), fresh_keys.begin(), fresh_keys.end(),
                 std::back_inserter(result.left.fresh));
  const BlockQueue queue(largest, order, result.left.fresh);
  const std::size_t budget =
      all ? std::numeric_limits<std::size_t>::max() : budget_of(map.parameters, queue.points());
  const std::size_t fewest =
      std::max(Constants::fewest_of_plane,
               static_cast<std::size_t>(map.parameters.min_surface_points()) / Constants::looks);
  std::size_t turn = 0;
  PointSet in_due;
  for (; turn < queue.size() && result.points.size() < budget; ++turn) {
    std::vector<PointId> come, points;
    for (const VoxelKey key : queue.points_of(turn))
      if (const PointId i = map.window.find(key); waits(i)) come.push_back(i);
    for (int level = 0; level < seed_patch_levels; ++level)
      add_due(map, VoxelBlocks(edge << level), come, fewest, in_due, points);
    const std::size_t left = budget - result.points.size();
    const bool over = points.size() > left;
    if (over) cut_to(map, left, result.points.empty(), edge, points);
    result.points.insert(result.points.end(), points.begin(), points.end());
    if (over) break;
  }
  result.left.blocks = queue.order_from(turn);
  const PointSet due(result.points);
  std::erase_if(result.left.fresh, [&](VoxelKey key) {
    if (queue.place_of(key) > turn) return false;
    const PointId i = map.window.find(key);
    return !waits(i) || due.contains(i);
  });
  result.waiting = turn < queue.size() ? queue.points_from(turn) : 0;
  map.window.put_in_order(result.points);
  return result;
}

std::vector<PointId> waiting_on(std::span<const PointId> too_few) {
  std::vector<PointId> some;
  for (std::size_t i = 0; i < too_few.size(); ++i)
    if (2 * i % 5 < 2) some.push_back(too_few[i]);
  return some;
}

}  // namespace octosurf::detection
