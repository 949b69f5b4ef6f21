#include "law/waiting.hpp"

#include "law/neighbour_labels.hpp"
#include "law/planelets.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

namespace octosurf::law {
namespace {

using Index = surfaces::MapView::Index;
using geometry::VoxelKey;

/// Voxels by the block that they lie in.
std::uint64_t block_of(VoxelKey key, int edge) {
  const auto part = [edge](std::uint16_t k) { return static_cast<std::uint16_t>(k / edge); };
  return VoxelKey{part(key.x), part(key.y), part(key.z)}.packed();
}

bool is_pending(const surfaces::MapView& map, VoxelKey key) {
  const Index i = map.window.find(key);
  return i != occupancy::PointWindow::none && map.window[i].surface == 0;
}

/// Those in the same block as this one, but for those that are due already.
std::vector<VoxelKey> pending_in_block(const surfaces::MapView& map, VoxelKey key, int edge,
                                       const std::set<VoxelKey>& due) {
  const auto middle = [edge](std::uint16_t k) {
    return static_cast<std::uint16_t>(std::min(65535, k / edge * edge + edge / 2));
  };
  std::vector<VoxelKey> pending;
  map.window.for_each_near({middle(key.x), middle(key.y), middle(key.z)}, (edge + 1) / 2, [&](Index i) {
    const occupancy::VoxelPoint& p = map.window[i];
    if (p.surface == 0 && block_of(p.key, edge) == block_of(key, edge) && !due.contains(p.key))
      pending.push_back(p.key);
  });
  return pending;
}

SurfaceId best_surface(const surfaces::MapView& map, const sensing::ReadingModel& model, Index i) {
  const occupancy::VoxelPoint p = map.window[i];
  NeighbourLabels near;
  map.window.for_each_near(p.key, 1, [&](Index j) {
    if (j != i) near.add(map.window[j].surface);
  });
  return near.best([&](SurfaceId id) {
    const Plane& plane = map.surfaces.find(id)->plane();
    return model.log_ratio(plane.signed_distance(p.position.cast<double>()), p.range_class,
                           plane.normal.dot(p.view.cast<double>()));
  });
}

/// In key order: what waited before, around what is new as far as it is still pending, and what is new.
std::vector<VoxelKey> all_waiting(const surfaces::MapView& map, std::vector<VoxelKey> before,
                                  std::span<const VoxelKey> fresh) {
  const int largest = planelet_edge(map.grid.resolution()) << (planelet_levels - 1);
  std::set<std::uint64_t> around;
  for (const VoxelKey key : fresh) around.insert(block_of(key, largest));
  std::erase_if(
      before, [&](VoxelKey key) { return around.contains(block_of(key, largest)) && !is_pending(map, key); });
  std::vector<VoxelKey> all;
  std::set_union(before.begin(), before.end(), fresh.begin(), fresh.end(), std::back_inserter(all));
  return all;
}

}  // namespace

std::vector<VoxelKey> take_in(surfaces::Ledger& ledger, std::span<const VoxelKey> pending,
                              double noise_factor2) {
  const sensing::ReadingModel model(ledger.noise, ledger.grid.resolution(), noise_factor2);
  std::vector<std::pair<Index, SurfaceId>> taken;  // given later, so that the order does not matter
  std::vector<VoxelKey> left;
  for (const VoxelKey key : pending) {
    const Index i = ledger.window.find(key);
    const SurfaceId best = best_surface(ledger, model, i);
    if (best == 0)
      left.push_back(key);
    else
      taken.emplace_back(i, best);
  }
  for (const auto& [i, surface] : taken) ledger.give(i, *ledger.find(surface));
  return left;
}

Waiting due_to_segment(const surfaces::MapView& map, std::vector<VoxelKey> before,
                       std::span<const VoxelKey> fresh) {
  constexpr std::size_t a_quarter = 4;  // as in SurfaceModel::recently_checked()
  const std::vector<VoxelKey> waiting = all_waiting(map, std::move(before), fresh);
  std::set<VoxelKey> due;
  for (int level = 0; level < planelet_levels; ++level) {
    const int edge = planelet_edge(map.grid.resolution()) << level;
    std::map<std::uint64_t, std::size_t> come;  // since their block was segmented last
    for (const VoxelKey key : fresh)
      if (!due.contains(key)) come.emplace(block_of(key, edge), 0);
    for (const VoxelKey key : waiting)
      if (const auto block = come.find(block_of(key, edge)); block != come.end() && !due.contains(key))
        ++block->second;
    for (const VoxelKey key : fresh) {
      const auto block = come.find(block_of(key, edge));
      if (block == come.end() || block->second < fewest_of_plane) continue;
      const std::vector<VoxelKey> pending = pending_in_block(map, key, edge, due);
      if (block->second * a_quarter >= pending.size()) due.insert(pending.begin(), pending.end());
      come.erase(block);  // it is looked at once
    }
  }
  Waiting result;
  result.due.assign(due.begin(), due.end());
  std::copy_if(waiting.begin(), waiting.end(), std::back_inserter(result.left),
               [&](VoxelKey key) { return !due.contains(key); });
  return result;
}

}  // namespace octosurf::law
