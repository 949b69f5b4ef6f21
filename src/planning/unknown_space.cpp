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

/// Unknown voxels of a box up to 64 voxels long, rows along x.
class Rows {
 public:
  Rows(const Eigen::Array3i& low, const Eigen::Array3i& high)
      : low_(low - beside), size_(high - low + 1 + 2 * beside) {
    rows_.assign(static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(size_.z()),
                 ~std::uint64_t{0});
  }

  void remove_known(const occupancy::Cube& cube) {
    const Eigen::Array3i key(cube.corner[0], cube.corner[1], cube.corner[2]);
    const Eigen::Array3i at = key - geometry::VoxelGrid::origin - low_;
    const int edge = 1 << cube.level;
    const Eigen::Array3i from = at.max(0), to = (at + edge).min(size_);
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

  template <class Visit>
  void for_each(const Visit& visit) const {
    for (int z = beside; z < size_.z() - beside; ++z)
      for (int y = beside; y < size_.y() - beside; ++y)
        for (std::uint64_t left = row(y, z) & run(beside, size_.x() - beside); left != 0; left &= left - 1)
          visit(Eigen::Array3i(low_ + Eigen::Array3i(std::countr_zero(left), y, z)));
  }

 private:
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

  Eigen::Array3i low_, size_;
  std::vector<std::uint64_t> rows_;
};

}  // namespace

void for_each_unknown(const OccupancyView& octree, const Eigen::AlignedBox3d& box,
                      const std::function<void(const Eigen::Vector3d&)>& visit) {
  const double d = octree.resolution();
  if (d <= 0 || box.isEmpty()) return;
  const Eigen::Array3i low = (box.min() / d).array().floor().cast<int>(),
                       high = (box.max() / d).array().floor().cast<int>();
  for (int x = low.x(); x <= high.x(); x += bits) {
    const Eigen::Array3i from(x, low.y(), low.z()), to(std::min(x + bits - 1, high.x()), high.y(), high.z());
    Rows rows(from, to);
    const Eigen::Vector3d first = ((from - beside).cast<double>() * d).matrix(),
                          last = ((to + 1 + beside).cast<double>() * d).matrix();
    occupancy::for_each_cube(octree, {first, last}, [&](const occupancy::Cube& cube) {
      rows.remove_known(cube);
      return true;
    });
    rows.open();
    rows.for_each([&](const Eigen::Array3i& voxel) { visit(((voxel.cast<double>() + 0.5) * d).matrix()); });
  }
}

const UnknownVoxels::Block& UnknownVoxels::block(const std::array<int, 3>& place) {
  const auto [found, fresh] = blocks_.try_emplace(place);
  Block& rows = found->second;
  if (!fresh) return rows;
  rows.fill(0);
  const Eigen::Array3i first = edge * Eigen::Array3i(place[0], place[1], place[2]);
  const double d = octree_.resolution();
  const Eigen::AlignedBox3d box(((first.cast<double>() + 0.5) * d).matrix(),
                                ((first.cast<double>() + edge - 0.5) * d).matrix());
  for_each_unknown(octree_, box, [&](const Eigen::Vector3d& centre) {
    const Eigen::Array3i in = (centre.array() / d).floor().cast<int>() - first;
    rows[static_cast<std::size_t>(in.z() * edge + in.y())] |= std::uint32_t{1} << in.x();
  });
  return rows;
}

void UnknownVoxels::for_each(const Eigen::AlignedBox3d& box,
                             const std::function<void(const Eigen::Vector3d&)>& visit) {
  const double d = octree_.resolution();
  if (d <= 0 || box.isEmpty()) return;
  const Eigen::Array3i low = (box.min() / d).array().floor().cast<int>(),
                       high = (box.max() / d).array().floor().cast<int>();
  const auto place = [](int voxel) { return voxel >= 0 ? voxel / edge : ~(~voxel / edge); };
  for (int bz = place(low.z()); bz <= place(high.z()); ++bz)
    for (int by = place(low.y()); by <= place(high.y()); ++by)
      for (int bx = place(low.x()); bx <= place(high.x()); ++bx) {
        const Block& rows = block({bx, by, bz});
        const Eigen::Array3i first = edge * Eigen::Array3i(bx, by, bz), from = (low - first).max(0),
                             to = (high - first).min(edge - 1);
        const std::uint32_t wanted = ~std::uint32_t{0} >> (edge - 1 - to.x() + from.x()) << from.x();
        for (int z = from.z(); z <= to.z(); ++z)
          for (int y = from.y(); y <= to.y(); ++y)
            for (std::uint32_t left = rows[static_cast<std::size_t>(z * edge + y)] & wanted; left != 0;
                 left &= left - 1) {
              const Eigen::Array3i in(std::countr_zero(left), y, z);
              visit((((first + in).cast<double>() + 0.5) * d).matrix());
            }
      }
}

}  // namespace octosurf::planning
