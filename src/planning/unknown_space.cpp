#include "planning/unknown_space.hpp"

#include "geometry/voxel_grid.hpp"
#include "occupancy/cubes.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <vector>

namespace octosurf::planning {
namespace {

constexpr int beside = 2;              // voxels: whether one lies in a cube of 3³ depends on these
constexpr int bits = 64 - 2 * beside;  // a row's voxels, without those beside them
constexpr int edge = 32;               // voxels, of a cached block

/// The voxels that a box meets.
Eigen::AlignedBox3i voxels_in(const Eigen::AlignedBox3d& box, double d) {
  return {(box.min() / d).array().floor().cast<int>().matrix(),
          (box.max() / d).array().floor().cast<int>().matrix()};
}

}  // namespace

/// Unknown voxels of a box up to 60 voxels long in which something could hide, rows along x.
class UnknownRows {
 public:
  UnknownRows(const OccupancyView& octree, const Eigen::AlignedBox3i& box)
      : d_(octree.resolution()),
        low_(box.min().array() - beside),
        size_(box.sizes().array() + 1 + 2 * beside) {
    rows_.assign(static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(size_.z()),
                 ~std::uint64_t{0});
    const Eigen::AlignedBox3d wide((low_.cast<double>() * d_).matrix(),
                                   ((low_ + size_).cast<double>() * d_).matrix());
    occupancy::for_each_cube(octree, wide,
                             [this](const occupancy::Cube& cube) { return remove_known(cube), true; });
    open();
  }

  /// Calls `visit(centre)` for those that lie in another box, too.
  void for_each(const Eigen::AlignedBox3i& box,
                const std::function<void(const Eigen::Vector3d&)>& visit) const {
    const Eigen::Array3i from = (box.min().array() - low_).max(beside),
                         to = (box.max().array() - low_ + 1).min(size_ - beside);
    for (int z = from.z(); z < to.z(); ++z)
      for (int y = from.y(); y < to.y(); ++y)
        for (std::uint64_t left = row(y, z) & run(from.x(), to.x()); left != 0; left &= left - 1) {
          const Eigen::Array3i voxel = low_ + Eigen::Array3i(std::countr_zero(left), y, z);
          visit(((voxel.cast<double>() + 0.5) * d_).matrix());
        }
  }

 private:
  void remove_known(const occupancy::Cube& cube) {
    const Eigen::Array3i key(cube.corner[0], cube.corner[1], cube.corner[2]);
    const Eigen::Array3i at = key - geometry::VoxelGrid::origin - low_;
    const Eigen::Array3i from = at.max(0), to = (at + (1 << cube.level)).min(size_);
    for (int z = from.z(); z < to.z(); ++z)
      for (int y = from.y(); y < to.y(); ++y) {
        const std::uint64_t known = cube.level > 2
                                        ? run(from.x(), to.x())
                                        : shifted(four(cube.known, y - at.y(), z - at.z()), at.x());
        row(y, z) &= ~known;
      }
  }

  /// Leaves only voxels that lie in a cube of 3³ unknown ones.
  void open() {
    const auto both = [](std::uint64_t a, std::uint64_t b) { return a & b; };
    const auto either = [](std::uint64_t a, std::uint64_t b) { return a | b; };
    spread(both);
    spread(either);
  }

  std::uint64_t& row(int y, int z) { return rows_[static_cast<std::size_t>(z * size_.y() + y)]; }
  std::uint64_t row(int y, int z) const { return rows_[static_cast<std::size_t>(z * size_.y() + y)]; }
  static std::uint64_t run(int from, int to) {
    if (to <= from) return 0;
    return (~std::uint64_t{0} >> (64 - (to - from))) << from;
  }
  static std::uint64_t shifted(std::uint64_t row, int by) {
    if (by <= -64 || by >= 64) return 0;
    return by < 0 ? row >> -by : row << by;
  }
  /// Of a cube's 64 bits in Morton order, those of one row along x.
  static std::uint64_t four(std::uint64_t cube, int y, int z) {
    const int first = (y & 1) << 1 | (y >> 1) << 4 | (z & 1) << 2 | (z >> 1) << 5;
    return (cube >> first & 1) | (cube >> (first + 1) & 1) << 1 | (cube >> (first + 8) & 1) << 2 |
           (cube >> (first + 9) & 1) << 3;
  }
  /// Combines each voxel with its 26 neighbours. What lies beyond the box counts as known; it reaches the
  /// outermost two layers only.
  template <class Combine>
  void spread(const Combine& combine) {
    for (std::uint64_t& one : rows_) one = combine(one, combine(one << 1, one >> 1));
    const auto along = [&](int count, int lines, const auto& at) {
      for (int line = 0; line < lines; ++line) {
        std::uint64_t before = 0;
        for (int i = 0; i < count; ++i) {
          const std::uint64_t here = at(i, line), after = i + 1 < count ? at(i + 1, line) : 0;
          at(i, line) = combine(here, combine(before, after));
          before = here;
        }
      }
    };
    along(size_.y(), size_.z(), [this](int y, int z) -> std::uint64_t& { return row(y, z); });
    along(size_.z(), size_.y(), [this](int z, int y) -> std::uint64_t& { return row(y, z); });
  }

  double d_;
  Eigen::Array3i low_, size_;
  std::vector<std::uint64_t> rows_;
};

void for_each_unknown(const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                      const std::function<void(const Eigen::Vector3d&)>& visit) {
  if (octree.resolution() <= 0 || box.isEmpty()) return;
  const Eigen::AlignedBox3i all = voxels_in(box, octree.resolution());
  for (Eigen::AlignedBox3i part = all; part.min().x() <= all.max().x(); part.min().x() += bits) {
    part.max().x() = std::min(part.min().x() + bits - 1, all.max().x());
    UnknownRows(octree, part).for_each(part, visit);
  }
}

void UnknownVoxels::for_each(const Eigen::AlignedBox3d& box,
                             const std::function<void(const Eigen::Vector3d&)>& visit) {
  if (resolution() <= 0 || box.isEmpty()) return;
  const Eigen::AlignedBox3i all = voxels_in(box, resolution());
  const auto block_of = [](int voxel) { return voxel >> 5; };
  const Eigen::Array3i first = all.min().unaryExpr(block_of), last = all.max().unaryExpr(block_of);
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) {
        std::shared_ptr<const UnknownRows>& rows = blocks_[{x, y, z}];
        const Eigen::Vector3i low = edge * Eigen::Vector3i(x, y, z);
        if (!rows)
          rows = std::make_shared<const UnknownRows>(
              octree_, Eigen::AlignedBox3i(low, (low.array() + edge - 1).matrix()));
        rows->for_each(all, visit);
      }
}

}  // namespace octosurf::planning
