#include "planning/column.hpp"

#include "geometry/voxel_grid.hpp"
#include "planning/rings.hpp"

#include <array>
#include <bit>

namespace octosurf::planning {
namespace {

constexpr std::size_t brick_voxels = 64;
/// Morton index of a voxel within its brick, of one coordinate.
constexpr std::array<std::uint8_t, 4> spread{0, 1, 8, 9};

}  // namespace

Columns::Columns(const OccupancyView& octree, const GroundPlane& plane, const Eigen::AlignedBox2d& part)
    : plane_(plane) {
  const double d = plane.d, reach = plane.depth() + 3 * d;  // see at()
  // On the border between two voxels rounding decides.
  const Eigen::AlignedBox3d box = box_about(box_over(plane.T_map_plane, part, -reach, reach), d / 2);
  const Eigen::Array3d low = (box.min() / d).array().floor() + geometry::VoxelGrid::origin,
                       high = (box.max() / d).array().floor() + geometry::VoxelGrid::origin;
  low_ = (low.max(0).min(65532)).cast<int>() / 4 * 4;
  bricks_ = ((high.max(0).min(65535)).cast<int>() - low_) / 4 + 1;
  origin_ = (plane.T_map_plane.translation() / d).array() + geometry::VoxelGrid::origin - low_.cast<double>();
  along_u_ = plane.T_map_plane.linear().col(0) / d;
  along_v_ = plane.T_map_plane.linear().col(1) / d;
  along_normal_ = plane.T_map_plane.linear().col(2) / d;
  thickness_ = reach / d;
  contents_.assign(static_cast<std::size_t>(bricks_.prod()) * brick_voxels, Content::unknown);
  occupancy::for_each_cube(octree, box, [this](const occupancy::Cube& cube) { return copy(cube), true; });
}

void Columns::copy(const occupancy::Cube& cube) {
  const Eigen::Array3i corner(cube.corner[0], cube.corner[1], cube.corner[2]);
  const Eigen::Array3i first = ((corner - low_) / 4).max(0),
                       last = ((corner - low_) / 4 + (1 << (cube.level - 2)) - 1).min(bricks_ - 1);
  constexpr double half_diagonal = 3.5;  // voxels, of a brick
  const Eigen::Vector3d normal = along_normal_ * plane_.d;
  for (int z = first.z(); z <= last.z(); ++z)
    for (int y = first.y(); y <= last.y(); ++y)
      for (int x = first.x(); x <= last.x(); ++x) {
        const Eigen::Vector3d middle = 4 * Eigen::Vector3d(x, y, z) + Eigen::Vector3d::Constant(2);
        if (std::fabs(normal.dot(middle - origin_)) > thickness_ + half_diagonal) continue;
        Content* contents = contents_.data() +
                            brick_voxels * static_cast<std::size_t>((z * bricks_.y() + y) * bricks_.x() + x);
        if (cube.known == ~std::uint64_t{0})
          std::fill_n(contents, brick_voxels, Content::free);
        else
          for (std::uint64_t m = cube.known; m != 0; m &= m - 1)
            contents[std::countr_zero(m)] = Content::free;
        for (std::uint64_t m = cube.occupied; m != 0; m &= m - 1) {
          const auto i = static_cast<unsigned>(std::countr_zero(m));
          const SurfaceId id = cube.surface(i);
          contents[i] = id == plane_.id ? Content::own : id != 0 ? Content::other : Content::pending;
        }
      }
}

Columns::Content Columns::content(const Eigen::Vector3d& place, double height) const {
  const Eigen::Array3d at = place + height * along_normal_;
  if (!(at >= 0).all() || !(at < 4 * bricks_.cast<double>()).all()) return Content::unknown;
  const Eigen::Array3i key = at.cast<int>();
  const auto in_brick = [](int k) {
    return static_cast<std::size_t>(spread[static_cast<std::size_t>(k & 3)]);
  };
  const auto brick = static_cast<std::size_t>(((key.z() >> 2) * bricks_.y() + (key.y() >> 2)) * bricks_.x() +
                                              (key.x() >> 2));
  return contents_[brick * brick_voxels +
                   (in_brick(key.x()) | in_brick(key.y()) << 1 | in_brick(key.z()) << 2)];
}

Columns::Seen Columns::at(const Eigen::Vector2d& uv) const {
  const double d = plane_.d, depth = plane_.depth();
  const Eigen::Vector3d place = place_of(uv);
  const Content on_plane = content(place);
  Seen seen;
  seen.reading = on_plane == Content::own;
  for (double t = d; !seen.reading && t < depth + d / 2; t += d)
    seen.reading = content(place, t) == Content::own || content(place, -t) == Content::own;
  if (seen.reading) return seen;
  seen.free = on_plane == Content::free;
  seen.open = seen.free && is_open(place);
  for (double t = d; t < depth + d / 2; t += d) {
    const Content before = content(place, t);
    seen.passed = seen.passed || (t < 2.5 * d && before == Content::free);  // two voxels
    seen.blocked = seen.blocked || (!seen.open && t > 1.25 * d && before == Content::other);
  }
  // Three voxels above what readings of the plane itself may reach.
  for (int k = 0; k < 3 && !seen.blocked && !seen.open; ++k)
    seen.blocked = content(place, depth + (k + 0.5) * d) >= Content::own;
  return seen;
}

/// Behind a free place: free to the depth, or to another surface before it. One in the next voxel may be the
/// same face, mapped twice.
bool Columns::is_open(const Eigen::Vector3d& place) const {
  const double d = plane_.d;
  // Steps of d/2: a step of d can miss a voxel cut at a corner.
  for (double t = d / 2; t < plane_.depth() + d / 4; t += d / 2) {
    const Content behind = content(place, -t);
    if (behind != Content::free) return t > 1.25 * d && behind == Content::other;
  }
  return true;
}

}  // namespace octosurf::planning
