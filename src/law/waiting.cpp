#include "law/waiting.hpp"

#include "law/neighbour_labels.hpp"
#include "law/planelets.hpp"
#include "law/voxel_blocks.hpp"

#include <algorithm>
#include <iterator>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>

namespace octosurf::law {
namespace {

using Index = surfaces::MapView::Index;
using geometry::VoxelKey;

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

/// Adds to `due` what of these blocks is.
void add_due(const surfaces::MapView& map, const VoxelBlocks& blocks, std::span<const VoxelKey> fresh,
             const std::vector<VoxelKey>& waiting, Keys& due) {
  tsl::robin_map<VoxelBlocks::Place, std::size_t, geometry::PackedKeyHash> come;  // since segmented last
  for (const VoxelKey key : fresh)
    if (!due.contains(key.packed())) come.try_emplace(blocks.of(key), 0);
  for (const VoxelKey key : waiting)
    if (const auto at = come.find(blocks.of(key)); at != come.end() && !due.contains(key.packed()))
      ++at.value();
  for (const VoxelKey key : fresh) {
    const auto at = come.find(blocks.of(key));
    if (at == come.end() || at->second < fewest_of_plane) continue;
    std::vector<VoxelKey> pending;
    blocks.for_each_point(map.window, at->first, [&](Index i) {
      const occupancy::VoxelPoint& p = map.window[i];
      if (p.surface == 0 && !due.contains(p.key.packed())) pending.push_back(p.key);
    });
    if (2 * at->second >= pending.size())
      for (const VoxelKey p : pending) due.insert(p.packed());
    come.erase(at);  // it is looked at once
  }
}

}  // namespace

std::vector<VoxelKey> take_in(surfaces::Ledger& ledger, std::span<const VoxelKey> pending) {
  const sensing::ReadingModel model(ledger.noise, ledger.grid.resolution());
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

std::set<SurfaceId> grow_from(surfaces::Ledger& ledger, std::vector<VoxelKey> given) {
  std::set<SurfaceId> grown;
  while (!given.empty()) {
    std::vector<VoxelKey> beside;
    for (const VoxelKey key : given)
      ledger.window.for_each_near(key, 1, [&](Index i) {
        if (ledger.window[i].surface == 0) beside.push_back(ledger.window[i].key);
      });
    std::sort(beside.begin(), beside.end());
    beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
    const std::vector<VoxelKey> left = take_in(ledger, beside);
    given.clear();
    std::set_difference(beside.begin(), beside.end(), left.begin(), left.end(), std::back_inserter(given));
    for (const VoxelKey key : given) grown.insert(ledger.window[ledger.window.find(key)].surface);
  }
  return grown;
}

Waiting due_to_segment(const surfaces::MapView& map, std::vector<VoxelKey> before,
                       std::span<const VoxelKey> fresh) {
  const int edge = planelet_edge(map.grid.resolution());
  std::vector<VoxelKey> around = take_around(before, fresh, edge);
  std::erase_if(around, [&](VoxelKey key) { return !map.is_pending(key); });
  around = united(around, fresh);
  Keys due;
  for (int level = 0; level < planelet_levels; ++level)
    add_due(map, VoxelBlocks(edge << level), fresh, around, due);
  std::erase_if(around, [&](VoxelKey key) { return due.contains(key.packed()); });
  Waiting result{.due = {}, .left = united(before, around)};
  for (const std::uint64_t key : due) result.due.push_back(VoxelKey::unpack(key));
  std::sort(result.due.begin(), result.due.end());
  return result;
}

std::vector<VoxelKey> waiting_on(std::span<const VoxelKey> too_few) {
  std::vector<VoxelKey> some;
  for (std::size_t i = 0; i < too_few.size(); ++i)
    if (2 * i % 5 < 2) some.push_back(too_few[i]);
  return some;
}

}  // namespace octosurf::law
