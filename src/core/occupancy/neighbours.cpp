#include "occupancy/neighbours.hpp"

#include <cstdlib>

namespace octosurf::occupancy {

Neighbours::Found Neighbours::search(PointId i) const {
  const geometry::VoxelKey key = window_[i].key;
  int reach = 0;
  while (reach == 0 || (reach < farthest_ && met_.size() < enough)) {
    met_.clear();
    window_.for_each_near(key, ++reach, [&](PointId j) {
      if (j != i) met_.push_back(j);
    });
  }
  if (chunks_.empty() || chunks_.back().capacity() - chunks_.back().size() < met_.size())
    chunks_.emplace_back().reserve(std::max(chunk, met_.size()));
  std::vector<PointId>& points = chunks_.back();
  const std::size_t first = points.size();
  points.insert(points.end(), met_.begin(), met_.end());
  if (found_.size() < window_.size()) found_.resize(window_.size());
  return found_[index_of(i)] = {std::span<const PointId>(points).subspan(first), reach};
}

int Neighbours::distance(PointId i, PointId j) const {
  const geometry::VoxelKey a = window_[i].key, b = window_[j].key;
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

}  // namespace octosurf::occupancy
