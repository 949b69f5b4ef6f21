#include "occupancy/agreement.hpp"

#include "occupancy/nearest_voxel.hpp"

namespace octosurf::occupancy {
namespace {

/// Rays by which a voxel must be more often free than occupied to speak against a reading.
constexpr float rays_against = 3;

class Comparison {
 public:
  Comparison(const VoxelTree& tree, const geometry::VoxelGrid& grid)
      : tree_(tree), grid_(grid), free_(std::max(rays_against * tree.model().miss, tree.model().clamp_min)) {}

  void add(const ReadingEnd& reading, Agreement& sum) const {
    if (NearestSearch(tree_, reading.end, grid_.resolution(), reading.reach).found())
      ++sum.agrees;
    else if (is_free_around(reading.end, reading.reach))
      ++sum.in_free_space;
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
  const VoxelTree& tree_;
  const geometry::VoxelGrid& grid_;
  float free_;  // log-odds
};

}  // namespace

Agreement agreement_of(std::span<const ReadingEnd> readings, const OccupancyView& octree) {
  Agreement sum;
  if (octree.tree() == nullptr || octree.tree()->empty()) return sum;
  const geometry::VoxelGrid grid(octree.resolution());
  const Comparison comparison(*octree.tree(), grid);
  for (const ReadingEnd& reading : readings) comparison.add(reading, sum);
  return sum;
}

}  // namespace octosurf::occupancy
