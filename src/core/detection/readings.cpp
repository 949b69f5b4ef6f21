#include "detection/readings.hpp"

#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace octosurf::detection {
Readings::Readings(const surfaces::MapView& map, const Neighbourhood& around)
    : cells_(map.cells),
      voxels_(map.window),
      window_(map.cells.map().window),
      grid_(map.cells.map().grid),
      model_(map.noise, grid_.resolution()) {
  std::vector<PointId> labelled = around.points;
  labelled.insert(labelled.end(), around.may_join.begin(), around.may_join.end());
  readings_.reserve(labelled.size() + around.context.size());
  add(std::move(labelled));
  for (const PointId i : around.may_join) readings_[find(i)].may_seed = false;
  size_ = readings_.size();
  add(around.context);
  at_border_.resize(readings_.size());
  first_.reserve(readings_.size() + 1);
  for (Index i = 0; i < readings_.size(); ++i) find_neighbours(map.cells.map().neighbours, i);
  first_.push_back(neighbours_.size());
}

void Readings::add(std::vector<PointId> points) {
  window_.put_in_order(points,
                       [](geometry::VoxelKey key) { return VoxelBlocks(8).of(key); });  // as the window's
  places_.resize(window_.size(), none);
  const float one_hit = 0.85F;  // nats of OctoMap's default; only ratios matter
  for (const PointId i : points) {
    const occupancy::VoxelPoint& p = window_[i];
    const float hits = std::max(1.0F, p.log_odds / one_hit);
    places_[index_of(i)] = static_cast<Index>(readings_.size());
    readings_.push_back({.key = p.key,
                         .position = p.position,
                         .view = p.view,
                         .range_class = p.range_class,
                         .hits = hits,
                         .surface = p.surface,
                         .point = i});
  }
}

void Readings::find_neighbours(const occupancy::Neighbours& all, Index i) {
  first_.push_back(neighbours_.size());
  bool missing = is_context(i);
  const int farthest = is_context(i) ? 1 : std::numeric_limits<int>::max();
  all.for_each_within(readings_[i].point, farthest, [&](PointId point) {
    if (const Index j = find(point); j != none)
      neighbours_.push_back(j);
    else
      missing = true;
  });
  at_border_[i] = missing;
}

void Readings::add_to(Patch& patch, Index i) const {
  const Reading& r = readings_[i];
  add_moments(patch, i);
  patch.log_peaks += model_.log_peak(r.range_class, r.cos_incidence(patch.plane));
  patch.readings += 1;
  patch.pose_variance = model_.pose_variance();
  patch.hits += r.hits;
}

}  // namespace octosurf::detection
