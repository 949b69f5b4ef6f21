#pragma once

#include "occupancy/point_window.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace octosurf::occupancy {

/// The points around each of a window's points: in the 26 voxels around, or, if fewer than six of these have
/// a point, within the smallest distance that gives six, at most 16 cm along each axis. Searched on first
/// access. Not thread-safe.
class Neighbours {
 public:
  static constexpr double farthest = 0.16;  ///< m; effort
  /// `reach` m in voxels, at least one.
  static int voxels(double reach, double resolution) {
    return std::max(1, static_cast<int>(std::floor(reach / resolution)));
  }

  Neighbours(const PointWindow& window, double resolution)
      : window_(window), farthest_(voxels(farthest, resolution)) {}

  /// Without the point itself, in the window's order; stays valid.
  std::span<const PointId> of(PointId i) const { return found(i).points; }
  /// visit(PointId) for those at most `reach` voxels away along each axis.
  template <class Visit>
  void for_each_within(PointId i, int reach, Visit&& visit) const {
    const Found near = found(i);
    for (const PointId j : near.points)
      if (near.reach <= reach || distance(i, j) <= reach) visit(j);
  }
  /// Whether they are those in the 26 voxels around.
  bool are_adjacent(PointId i) const {
    return farthest_ == 1 || window_.count_near(window_[i].key, 1) > enough;
  }

 private:
  static constexpr std::size_t enough = 6;  // effort: as in a hexagonal grid
  static constexpr std::size_t chunk = 1 << 16;
  struct Found {
    std::span<const PointId> points;
    int reach = 0;  // voxels; 0: not searched yet
  };
  Found found(PointId i) const {
    if (index_of(i) < found_.size() && found_[index_of(i)].reach > 0) return found_[index_of(i)];
    return search(i);
  }
  Found search(PointId i) const;
  int distance(PointId i, PointId j) const;

  const PointWindow& window_;
  int farthest_;
  mutable std::vector<Found> found_;  // by point
  mutable std::vector<std::vector<PointId>> chunks_;
  mutable std::vector<PointId> met_;  // scratch
};

}  // namespace octosurf::occupancy
