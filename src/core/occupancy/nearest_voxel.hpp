#pragma once

#include "occupancy/key_box.hpp"
#include "occupancy/voxel_tree.hpp"

#include <bit>
#include <utility>

namespace octosurf::occupancy {

/// Mask of the occupied voxels of a brick.
inline std::uint64_t occupied_in(const VoxelTree& tree, const VoxelTree::Brick& brick) {
  if (!tree.occupied_without_points()) return brick.points;
  std::uint64_t occupied = 0;
  for (std::uint64_t m = brick.known; m != 0; m &= m - 1)
    if (tree.occupied(brick.value[static_cast<std::size_t>(std::countr_zero(m))])) occupied |= m & ~(m - 1);
  return occupied;
}
/// The voxel of a brick with this Morton index.
inline Key3 key_in(const Key3& brick_corner, unsigned i) {
  const geometry::VoxelKey inside = VoxelTree::key_of(i);
  return {brick_corner[0] + inside.x, brick_corner[1] + inside.y, brick_corner[2] + inside.z};
}

/// Finds the occupied voxel nearest to a point by branch and bound.
class NearestSearch {
 public:
  NearestSearch(const VoxelTree& tree, const Eigen::Vector3d& point, double resolution, double limit)
      : tree_(tree), point_(point), resolution_(resolution), best2_(limit * limit) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double place =
          point_[static_cast<Eigen::Index>(i)] / resolution_ + geometry::VoxelGrid::origin - 0.5;
      nearest_[i] =
          static_cast<int>(std::clamp(std::ceil(place - 0.5), 0.0, double{geometry::VoxelGrid::last}));
    }
    below(tree_.root(), {0, 0, 0});
  }

  bool found() const { return found_; }
  const Key3& key() const { return key_; }

 private:
  /// Along one axis: the centre from `low` to `high` nearest to the point, the lower one on a tie, and its
  /// squared distance.
  int nearest_in(std::size_t axis, int low, int high) const { return std::clamp(nearest_[axis], low, high); }
  double distance2(std::size_t axis, int key) const {
    const double distance = centre_of(key, resolution_) - point_[static_cast<Eigen::Index>(axis)];
    return distance * distance;
  }

  void offer(const Key3& key) {
    const double d2 = distance2(0, key[0]) + distance2(1, key[1]) + distance2(2, key[2]);
    if (d2 > best2_ || (found_ && d2 == best2_ && morton_of(key) > morton_of(key_))) return;
    best2_ = d2;
    key_ = key;
    found_ = true;
  }

  void in_brick(const VoxelTree::Brick& brick, const Key3& corner) {
    for (std::uint64_t m = occupied_in(tree_, brick); m != 0; m &= m - 1)
      offer(key_in(corner, static_cast<unsigned>(std::countr_zero(m))));
  }

  /// An undivided, occupied cube.
  void in_leaf(const Key3& corner, int level) {
    Key3 key;
    for (std::size_t i = 0; i < 3; ++i) key[i] = nearest_in(i, corner[i], corner[i] + (1 << level) - 1);
    offer(key);
  }

  void below(const VoxelTree::Node& node, const Key3& corner) {
    if (const VoxelTree::Brick* brick = node.brick()) return in_brick(*brick, corner);
    if (!node.has_children()) {
      if (node.exists() && tree_.occupied(node.log_odds())) in_leaf(corner, node.level());
      return;
    }
    // A child is in the lower or upper half along each axis: six distances give all eight.
    const int half = 1 << (node.level() - 1);
    std::array<std::array<double, 2>, 3> halves;
    for (std::size_t i = 0; i < 3; ++i) {
      const int middle = corner[i] + half;
      halves[i] = {distance2(i, nearest_in(i, corner[i], middle - 1)),
                   distance2(i, nearest_in(i, middle, middle + half - 1))};
    }
    std::array<std::pair<double, unsigned>, 8> order;  // nearest first
    std::size_t count = 0;
    for (unsigned c = 0; c < 8; ++c) {
      const VoxelTree::Node child = node.child(c);
      if (!child.may_be_occupied()) continue;
      const double d2 = halves[0][c & 1] + halves[1][c >> 1 & 1] + halves[2][c >> 2];
      if (d2 > best2_) continue;
      std::size_t place = count++;
      for (; place > 0 && d2 < order[place - 1].first; --place) order[place] = order[place - 1];
      order[place] = {d2, c};
    }
    for (std::size_t k = 0; k < count; ++k) {
      const auto& [d2, c] = order[k];
      if (d2 > best2_) return;
      below(node.child(c), child_corner(corner, c, node.level() - 1));
    }
  }

  const VoxelTree& tree_;
  Eigen::Vector3d point_;
  double resolution_, best2_;
  Key3 nearest_{};  // the voxel that contains the point, or is nearest to it
  Key3 key_{};
  bool found_ = false;
};

}  // namespace octosurf::occupancy
