#include "detection/waiting.hpp"

#include "detection/constants.hpp"
#include "detection/planelets.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>
#include <tuple>

namespace octosurf::detection {
namespace {

using Index = surfaces::MapView::Index;
using geometry::VoxelKey;

using Keys = tsl::robin_set<std::uint64_t, geometry::PackedKeyHash>;

std::vector<VoxelKey> united(const std::vector<VoxelKey>& a, std::span<const VoxelKey> b) {
  std::vector<VoxelKey> all;
  all.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

/// Adds the points of these blocks to `due`, except those taken. `come`: points that came since the last
/// segmentation.
void add_due(const surfaces::MapView& map, const VoxelBlocks& blocks, std::span<const VoxelKey> come,
             const Keys& taken, Keys& due) {
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> counts;
  for (const VoxelKey key : come)
    if (!due.contains(key.packed())) ++counts[blocks.of(key)];
  for (const auto& [place, count] : counts) {
    if (count < Constants::fewest_of_plane) continue;
    std::vector<VoxelKey> pending;
    blocks.for_each_point(map.window, place, [&](Index i) {
      const occupancy::VoxelPoint& p = map.window[i];
      if (p.surface == 0 && !due.contains(p.key.packed()) && !taken.contains(p.key.packed()))
        pending.push_back(p.key);
    });
    if (2 * count >= pending.size())
      for (const VoxelKey p : pending) due.insert(p.packed());
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

/// Cuts to `most` points, in whole, adjacent blocks of planelets; if `some`, at least one of these.
void cut_to(std::size_t most, bool some, int edge, std::vector<VoxelKey>& points) {
  const auto nested = [&](VoxelKey key) {
    return std::tuple(VoxelBlocks(4 * edge).of(key), VoxelBlocks(2 * edge).of(key),
                      VoxelBlocks(edge).of(key));
  };
  std::sort(points.begin(), points.end(),
            [&](VoxelKey a, VoxelKey b) { return std::tuple(nested(a), a) < std::tuple(nested(b), b); });
  const auto within_block = [&](std::size_t k) { return nested(points[k]) == nested(points[k - 1]); };
  std::size_t end = most;
  while (end > 0 && within_block(end)) --end;
  if (end == 0 && some)
    for (end = std::max<std::size_t>(most, 1); end < points.size() && within_block(end);) ++end;
  points.resize(end);
}

/// The blocks whose due points contain a plane of their own.
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

Due due_to_segment(const surfaces::MapView& map, const occupancy::OccupancyMap& octree,
                   surfaces::PendingQueue before, std::span<const VoxelKey> fresh, bool all,
                   std::vector<Assignment>& expanded) {
  const int edge = planelet_edge(map.grid.resolution());
  const VoxelBlocks smallest(edge), largest(edge << (planelet_levels - 1));
  Keys taken;
  for (const Assignment& assignment : expanded) taken.insert(map.window[assignment.point].key.packed());
  const auto waits = [&](VoxelKey key) { return map.is_pending(key) && !taken.contains(key.packed()); };
  std::copy_if(fresh.begin(), fresh.end(), std::back_inserter(before.blocks), waits);
  Due result;
  result.left.fresh = united(before.fresh, fresh);
  const BlockQueue queue(largest, before.blocks, result.left.fresh);
  const std::size_t budget =
      all ? std::numeric_limits<std::size_t>::max() : budget_of(map.parameters, queue.points());
  std::size_t turn = 0;
  for (; turn < queue.size() && result.points.size() < budget; ++turn) {
    std::vector<VoxelKey> come;
    std::copy_if(queue.points_of(turn).begin(), queue.points_of(turn).end(), std::back_inserter(come), waits);
    Keys due;
    for (int level = 0; level < planelet_levels; ++level)
      add_due(map, VoxelBlocks(edge << level), come, taken, due);
    std::vector<VoxelKey> points;
    for (const std::uint64_t key : due) points.push_back(VoxelKey::unpack(key));
    const std::size_t left = budget - result.points.size();
    const bool over = points.size() > left;
    if (over) cut_to(left, result.points.empty(), edge, points);
    result.points.insert(result.points.end(), points.begin(), points.end());
    if (over) break;
  }
  result.left.blocks = queue.order_from(turn);
  Keys due;
  for (const VoxelKey key : result.points) due.insert(key.packed());
  std::erase_if(result.left.fresh, [&](VoxelKey key) {
    return queue.place_of(key) <= turn && (due.contains(key.packed()) || !waits(key));
  });
  result.waiting = turn < queue.size() ? queue.points_from(turn) : 0;
  const Keys with_planes = blocks_with_planes(map, octree, smallest, result.points);
  std::erase_if(expanded, [&](const Assignment& assignment) {
    const VoxelKey key = map.window[assignment.point].key;
    if (!with_planes.contains(smallest.of(key))) return false;
    result.points.push_back(key);
    return true;
  });
  const auto unplanar = std::stable_partition(result.points.begin(), result.points.end(), [&](VoxelKey key) {
    return with_planes.contains(smallest.of(key));
  });
  result.unplanar.assign(unplanar, result.points.end());
  result.points.erase(unplanar, result.points.end());
  std::sort(result.unplanar.begin(), result.unplanar.end());
  std::sort(result.points.begin(), result.points.end());
  return result;
}

std::vector<VoxelKey> waiting_on(std::span<const VoxelKey> too_few) {
  std::vector<VoxelKey> some;
  for (std::size_t i = 0; i < too_few.size(); ++i)
    if (2 * i % 5 < 2) some.push_back(too_few[i]);
  return some;
}

}  // namespace octosurf::detection
