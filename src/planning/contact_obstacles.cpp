#include "planning/contact_obstacles.hpp"

#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "planning/unknown_space.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <utility>

namespace octosurf::planning {
namespace {

/// Whole voxels low … high, both included.
struct VoxelBox {
  std::array<std::int32_t, 3> low, high;
};

/// Area covered by a flat voxel: from … to along a line through the surface's origin, rows low … high beside
/// it.
struct Strip {
  Eigen::Vector2d along;  ///< unit
  std::int64_t low = 0, high = 0;
  double from = 0, to = 0;  ///< m

  bool same_row(const Strip& other) const {
    return along == other.along && low == other.low && high == other.high;
  }
};

/// The direction of a plane's intersection with that of (u, v), across which a steep one's voxels are narrow;
/// for a flatter one the map's x or y axis, along which voxels are aligned.
Eigen::Vector2d intersection_line(const Eigen::Matrix<double, 3, 2>& uv, const Eigen::Vector3d& normal) {
  constexpr double flat = 0.5;  // sine: of 30°, where a voxel is narrower by an eighth
  const Eigen::Vector2d steepest = uv.transpose() * normal;
  if (steepest.norm() > flat) return Eigen::Vector2d(steepest.y(), -steepest.x()).normalized();
  Eigen::Index axis = 0;
  uv.rowwise().norm().maxCoeff(&axis);
  return uv.row(axis).transpose().normalized();
}

/// Merges boxes that differ along `axis` only and touch there.
void join_along(std::size_t axis, std::vector<VoxelBox>& boxes) {
  const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
  const auto others = [b, c](const VoxelBox& box) {
    return std::array{box.low[b], box.high[b], box.low[c], box.high[c]};
  };
  std::sort(boxes.begin(), boxes.end(), [&](const VoxelBox& x, const VoxelBox& y) {
    const auto xs = others(x), ys = others(y);
    return xs != ys ? xs < ys : x.low[axis] < y.low[axis];
  });
  std::vector<VoxelBox> joined;
  for (const VoxelBox& box : boxes) {
    if (!joined.empty() && others(joined.back()) == others(box) &&
        joined.back().high[axis] + 1 >= box.low[axis])
      joined.back().high[axis] = std::max(joined.back().high[axis], box.high[axis]);
    else
      joined.push_back(box);
  }
  boxes = std::move(joined);
}

/// Extends boxes along the plane's steepest axis to whole layers, in which they move by an eighth of a voxel
/// at most: those of one layer join into few, as they cover the same.
void extend_along(std::size_t axis, double cosine, std::vector<VoxelBox>& boxes) {
  constexpr double most = 0.125, thickest = 1024;  // voxels
  const double slope = std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
  const auto layer = static_cast<std::int32_t>(std::clamp(most / std::max(slope, 1e-9), 1.0, thickest));
  for (VoxelBox& box : boxes) {
    const std::int32_t z = box.low[axis];
    box.low[axis] = z - ((z % layer) + layer) % layer;
    box.high[axis] = box.low[axis] + layer - 1;
  }
}

Ring2 project(const Surface& surface, const VoxelBox& box, double d) {
  const Eigen::Isometry3d T_surface_map = surface.T_map_surface.inverse();
  Ring2 corners;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d p;
    for (unsigned axis = 0; axis < 3; ++axis)
      p[axis] = d * ((corner >> axis & 1u) != 0 ? box.high[axis] + 1 : box.low[axis]);
    corners.emplace_back((T_surface_map * p).head<2>());
  }
  return convex_hull(std::move(corners));
}

/// In the map's frame, about part of the space over the surface.
Eigen::AlignedBox3d box_over(const Surface& surface, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                             double from, double to) {
  Eigen::AlignedBox3d box;
  for (const double u : {low.x(), high.x()})
    for (const double v : {low.y(), high.y()})
      for (const double z : {from, to}) box.extend(surface.T_map_surface * Eigen::Vector3d(u, v, z));
  return box;
}

}  // namespace

std::vector<Ring2> obstacles_over(const Surface& surface, const Eigen::Vector2d& low,
                                  const Eigen::Vector2d& high, const ContactLimits& limits,
                                  const OccupancyView& octree, const Snapshot* others) {
  Eigen::AlignedBox3d box = box_over(surface, low, high, limits.obstacle_from_m, limits.clearance_m);
  // The corners of a rectangle are √2 times as far off as its reach, plus rounding.
  const double beside = 2 * MatterOfVoxels::farthest_reach * octree.resolution() +
                        (others != nullptr ? MatterOfVoxels::farthest_move : 0);
  box.min().array() -= beside;
  box.max().array() += beside;
  std::vector<Eigen::Vector3d> cubes;
  std::vector<VoxelMatter> flat;
  MatterOfVoxels matter_of(others, octree.resolution());
  octree.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface == surface.id) return true;
    const VoxelMatter matter = matter_of(voxel);
    const double height = surface.plane.signed_distance(matter.middle);
    const double half = matter.reach(surface.plane.normal);
    if (height + half <= limits.obstacle_from_m || height - half >= limits.clearance_m) return true;
    if (matter.flat())
      flat.push_back(matter);
    else
      cubes.push_back(matter.middle);
    return true;
  });
  std::vector<Ring2> covered = projected(surface, cubes, octree.resolution());
  for (Ring2& ring : projected(surface, flat)) covered.push_back(std::move(ring));
  return covered;
}

std::vector<Ring2> unknown_over(const Surface& surface, const Eigen::Vector2d& low,
                                const Eigen::Vector2d& high, const ContactLimits& limits,
                                const OccupancyView& octree) {
  constexpr double patch = 32;  // voxels: boxes about patches of a slope hold little beside its slab
  const double d = octree.resolution();
  if (d <= 0) return {};  // an empty view
  const double beside = MatterOfVoxels::farthest_reach * d;
  const double half = d / 2 * surface.plane.normal.lpNorm<1>();
  std::vector<Eigen::Vector3d> centres;
  for (double u = low.x(); u <= high.x(); u += patch * d)
    for (double v = low.y(); v <= high.y(); v += patch * d) {
      const Eigen::Vector2d from(u, v), to = (from.array() + patch * d).min(high.array());
      Eigen::AlignedBox3d box = box_over(surface, from, to, limits.obstacle_from_m, limits.unknown_to_m);
      box.min().array() -= beside;
      box.max().array() += beside;
      for_each_unknown(octree, box, [&](const Eigen::Vector3d& centre) {
        const double height = surface.plane.signed_distance(centre);
        if (height + half > limits.obstacle_from_m && height - half < limits.unknown_to_m)
          centres.push_back(centre);
      });
    }
  return projected(surface, centres, d);
}

std::vector<Ring2> projected(const Surface& surface, std::span<const Eigen::Vector3d> centres, double d) {
  std::vector<VoxelBox> boxes;
  boxes.reserve(centres.size());
  for (const Eigen::Vector3d& centre : centres) {
    VoxelBox box{};
    for (unsigned axis = 0; axis < 3; ++axis)
      box.low[axis] = static_cast<std::int32_t>(std::floor(centre[axis] / d));
    box.high = box.low;
    boxes.push_back(box);
  }
  // Along the normal first: the voxels of a column cover one another.
  Eigen::Index steepest = 0;
  const double cosine = surface.plane.normal.cwiseAbs().maxCoeff(&steepest);
  extend_along(static_cast<std::size_t>(steepest), cosine, boxes);
  for (std::size_t step = 0; step < 3; ++step)
    join_along((static_cast<std::size_t>(steepest) + step) % 3, boxes);
  std::vector<Ring2> covered;
  covered.reserve(boxes.size());
  for (const VoxelBox& box : boxes) covered.push_back(project(surface, box, d));
  return covered;
}

// Each covers a rectangle along the intersection of its plane with this one, as wide as its row: those of a
// wall become one.
std::vector<Ring2> projected(const Surface& surface, std::span<const VoxelMatter> flat) {
  constexpr double row_width = sensing::ReadingModel::pose_sigma;
  std::vector<Strip> strips;
  strips.reserve(flat.size());
  const Eigen::Matrix<double, 3, 2> uv = surface.T_map_surface.linear().leftCols<2>();
  const Eigen::Vector3d& origin = surface.T_map_surface.translation();
  for (const VoxelMatter& matter : flat) {
    const Eigen::Vector2d along = intersection_line(uv, matter.normal), across(-along.y(), along.x());
    const Eigen::Vector2d middle = uv.transpose() * (matter.middle - origin);
    const double half = matter.reach(uv * along), at = along.dot(middle);
    // Depths of one surface's voxels differ little; in fixed steps they are equal.
    const auto depth = static_cast<std::int64_t>(std::ceil(matter.reach(uv * across) / row_width));
    const auto row = static_cast<std::int64_t>(std::floor(across.dot(middle) / row_width));
    strips.push_back({along, row - depth, row + depth + 1, at - half, at + half});
  }
  std::sort(strips.begin(), strips.end(), [](const Strip& a, const Strip& b) {
    return std::tuple(a.along.x(), a.along.y(), a.low, a.high, a.from) <
           std::tuple(b.along.x(), b.along.y(), b.low, b.high, b.from);
  });
  std::vector<Ring2> covered;
  for (auto first = strips.begin(); first != strips.end();) {
    double to = first->to;
    auto next = first + 1;
    for (; next != strips.end() && next->same_row(*first) && next->from <= to; ++next)
      to = std::max(to, next->to);
    const Eigen::Vector2d across(-first->along.y(), first->along.x());
    const Eigen::Vector2d from = first->from * first->along, end = to * first->along,
                          low = row_width * static_cast<double>(first->low) * across,
                          high = row_width * static_cast<double>(first->high) * across;
    covered.push_back({from + low, end + low, end + high, from + high});
    first = next;
  }
  return covered;
}

}  // namespace octosurf::planning
