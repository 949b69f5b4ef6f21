#include "occupancy/nearest_voxel.hpp"
#include "occupancy/occupancy_map.hpp"

namespace octosurf::occupancy {
namespace {

/// Readings by which a voxel must be more often occupied than free, or the reverse, to speak against a scan.
constexpr float readings_against = 3;

class Comparison {
 public:
  Comparison(const VoxelTree& tree, const geometry::VoxelGrid& grid)
      : tree_(tree),
        grid_(grid),
        free_(std::max(readings_against * tree.model().miss, tree.model().clamp_min)),
        matter_(std::min(readings_against * tree.model().hit, tree.model().clamp_max)) {}

  void add(const SightLine& line, Agreement& sum) const {
    if (NearestSearch(tree_, line.end, grid_.resolution(), line.reach).found())
      ++sum.agrees;
    else if (is_free_around(line.end, line.reach))
      ++sum.in_free_space;
    else if (passes_matter(line))
      ++sum.behind_matter;
  }

 private:
  VoxelTree::Lookup at(const Eigen::Vector3d& p) const {
    geometry::VoxelKey key;
    return grid_.key_of(p.cast<float>(), key) ? tree_.find(key) : VoxelTree::Lookup{};
  }
  bool is_free(const Eigen::Vector3d& p) const {
    const VoxelTree::Lookup voxel = at(p);
    return voxel.known && voxel.log_odds <= free_;
  }
  bool is_free_around(const Eigen::Vector3d& p, double reach) const {
    if (!is_free(p)) return false;
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-reach, reach})
        if (!is_free(p + side * Eigen::Vector3d::Unit(axis))) return false;
    return true;
  }
  /// Steps through the octree's undivided cubes.
  bool passes_matter(const SightLine& line) const {
    const double d = grid_.resolution(), length = (line.end - line.start).norm() - 2 * line.reach;
    const Eigen::Vector3d along = (line.end - line.start).normalized();
    for (double t = 2 * line.reach; t < length;) {
      const Eigen::Vector3d p = line.start + t * along;
      const VoxelTree::Lookup voxel = at(p);
      if (voxel.known && voxel.log_odds >= matter_) return true;
      const double edge = d * (1 << voxel.level);
      double leaves = edge * std::sqrt(3.0);
      for (int axis = 0; axis < 3; ++axis)
        if (along[axis] != 0) {
          const double low = std::floor(p[axis] / edge) * edge;
          leaves = std::min(leaves, (along[axis] > 0 ? low + edge - p[axis] : low - p[axis]) / along[axis]);
        }
      t += leaves + 0.01 * d;  // into the next one
    }
    return false;
  }

  const VoxelTree& tree_;
  const geometry::VoxelGrid& grid_;
  float free_, matter_;  // log-odds
};

}  // namespace

Agreement OccupancyMap::agreement_with(std::span<const SightLine> lines) const {
  Agreement sum;
  if (tree_->empty()) return sum;
  const Comparison comparison(*tree_, grid_);
  for (const SightLine& line : lines) comparison.add(line, sum);
  return sum;
}

}  // namespace octosurf::occupancy
