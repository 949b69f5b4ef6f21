#include "occupancy/neighbours.hpp"

#include <cstdlib>

namespace octosurf::occupancy {

Neighbours::Found Neighbours::search(PointId i) const {
  const geometry::VoxelKey key = window_[i].key;
  int reach = 1;
  while (reach < farthest_ && window_.count_near(key, reach) <= enough) ++reach;
  const std::size_t count = window_.count_near(key, reach) - 1;
  if (chunks_.empty() || chunks_.back().capacity() - chunks_.back().size() < count)
    chunks_.emplace_back().reserve(std::max(chunk, count));
  std::vector<PointId>& points = chunks_.back();
  const std::size_t first = points.size();
  window_.for_each_near(key, reach, [&](PointId j) {
    if (j != i) points.push_back(j);
  });
  if (found_.size() < window_.size()) found_.resize(window_.size());
  return found_[index_of(i)] = {std::span<const PointId>(points).subspan(first), reach};
}

int Neighbours::distance(PointId i, PointId j) const {
  const geometry::VoxelKey a = window_[i].key, b = window_[j].key;
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

}  // namespace octosurf::occupancy
