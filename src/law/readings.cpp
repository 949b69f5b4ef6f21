#include "law/readings.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::law {
namespace {

// Effort: how far neighbours are looked for where readings are sparse. Six are what a hexagon has.
constexpr std::size_t enough_neighbours = 6;
constexpr double farthest_neighbour = 0.16;  // m

}  // namespace

Readings::Readings(const occupancy::OccupancyMap& octree, const occupancy::PointWindow& window,
                   const sensing::NoiseModel& noise, double noise_factor2)
    : window_(window), grid_(octree.grid()), model_(noise, octree.grid().resolution(), noise_factor2) {
  std::vector<geometry::VoxelKey> keys;
  octree.for_each_point([&](const occupancy::VoxelPoint& p) { keys.push_back(p.key); });
  for (const geometry::VoxelKey key : keys) window_.find(key);  // loads its block
  readings_.reserve(window_.size());
  const float one_hit = 0.85F;  // nats of OctoMap's default; only ratios are asked for
  for (Index i = 0; i < window_.size(); ++i) {
    const occupancy::VoxelPoint& p = window_[i];
    const float hits = std::max(1.0F, octree.at(p.key).log_odds / one_hit);
    readings_.push_back({p.key, p.position, p.view, p.range_class, hits});
  }
  first_.reserve(readings_.size() + 1);
  for (Index i = 0; i < readings_.size(); ++i) find_neighbours(i);
  first_.push_back(neighbours_.size());
}

void Readings::find_neighbours(Index i) {
  first_.push_back(neighbours_.size());
  const int farthest = std::max(1, static_cast<int>(std::floor(farthest_neighbour / resolution())));
  for (int reach = 1; reach <= farthest; ++reach) {
    neighbours_.resize(first_.back());
    window_.for_each_near(readings_[i].key, reach, [&](Index j) {
      if (j != i) neighbours_.push_back(j);
    });
    if (neighbours_.size() - first_.back() >= enough_neighbours) return;
  }
}

void Readings::add_to(Patch& patch, Index i) const {
  const Reading& r = readings_[i];
  const double facing = r.facing(patch.plane);
  patch.moments.add(r.position.cast<double>() - patch.origin, model_.weight(r.range_class, facing));
  patch.log_peaks += model_.log_peak(r.range_class, facing);
  patch.readings += 1;
  patch.hits += r.hits;
}

}  // namespace octosurf::law
