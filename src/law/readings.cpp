#include "law/readings.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::law {
namespace {

// Effort: how far neighbours are looked for where readings are sparse. Six are what a hexagon has.
constexpr std::size_t enough_neighbours = 6;
constexpr double farthest_neighbour = 0.16;  // m

std::vector<geometry::VoxelKey> all_of(const occupancy::OccupancyMap& octree) {
  std::vector<geometry::VoxelKey> keys;
  octree.for_each_point([&](const occupancy::VoxelPoint& p) { keys.push_back(p.key); });
  return keys;
}

/// Of 8³ voxels, as the window's.
std::uint64_t block_of(geometry::VoxelKey key) { return key.packed() >> 3 & 0x1fff1fff1fffULL; }

}  // namespace

Readings::Readings(const occupancy::OccupancyMap& octree, const occupancy::PointWindow& window,
                   const sensing::NoiseModel& noise)
    : Readings(octree, window, {.voxels = all_of(octree), .followers = {}, .context = {}}, noise) {}

Readings::Readings(const occupancy::OccupancyMap& octree, const occupancy::PointWindow& window,
                   const Neighbourhood& around, const sensing::NoiseModel& noise)
    : window_(window), grid_(octree.grid()), model_(noise, octree.grid().resolution()) {
  readings_.reserve(around.voxels.size() + around.followers.size() + around.context.size());
  add(around.voxels, around.followers, octree);
  size_ = readings_.size();
  add(around.context, {}, octree);
  at_border_.assign(readings_.size(), true);
  first_.reserve(readings_.size() + 1);
  for (Index i = 0; i < readings_.size(); ++i) find_neighbours(i);
  first_.push_back(neighbours_.size());
}

void Readings::add(std::span<const geometry::VoxelKey> voxels, std::span<const geometry::VoxelKey> followers,
                   const occupancy::OccupancyMap& octree) {
  std::vector<Index> in_window;
  in_window.reserve(voxels.size() + followers.size());
  for (const auto keys : {voxels, followers})
    for (const geometry::VoxelKey key : keys)
      if (const Index i = window_.find(key); i != none) in_window.push_back(i);
  std::sort(in_window.begin(), in_window.end(), [&](Index a, Index b) {
    return std::pair(block_of(window_[a].key), a) < std::pair(block_of(window_[b].key), b);
  });
  places_.resize(window_.size(), none);
  const float one_hit = 0.85F;  // nats of OctoMap's default; only ratios are asked for
  for (const Index i : in_window) {
    const occupancy::VoxelPoint& p = window_[i];
    const float hits = std::max(1.0F, octree.at(p.key).log_odds / one_hit);
    places_[i] = static_cast<Index>(readings_.size());
    readings_.push_back({.key = p.key,
                         .position = p.position,
                         .view = p.view,
                         .range_class = p.range_class,
                         .hits = hits,
                         .surface = p.surface,
                         .in_window = i});
  }
  for (const geometry::VoxelKey key : followers)
    if (const Index i = find(key); i != none) readings_[i].follows = true;
}

void Readings::find_neighbours(Index i) {
  first_.push_back(neighbours_.size());
  const int farthest = std::max(1, static_cast<int>(std::floor(farthest_neighbour / resolution())));
  for (int reach = 1; reach <= farthest; ++reach) {
    neighbours_.resize(first_.back());
    std::size_t missing = 0;
    window_.for_each_near(readings_[i].key, reach, [&](Index in_window) {
      const Index j = of_window(in_window);
      if (j == none)
        ++missing;
      else if (j != i)
        neighbours_.push_back(j);
    });
    if (is_context(i)) return;
    at_border_[i] = missing > 0;
    if (neighbours_.size() - first_.back() + missing >= enough_neighbours) return;
  }
}

void Readings::add_to(Patch& patch, Index i) const {
  const Reading& r = readings_[i];
  const double facing = r.facing(patch.plane);
  patch.moments.add(r.position.cast<double>() - patch.origin, model_.weight(r.range_class, facing));
  patch.log_peaks += model_.log_peak(r.range_class, facing);
  patch.readings += 1;
  patch.pose_variance = model_.pose_variance();
  patch.hits += r.hits;
}

}  // namespace octosurf::law
