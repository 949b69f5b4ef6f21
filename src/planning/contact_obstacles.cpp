#include "planning/contact_obstacles.hpp"

#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace octosurf {
namespace {

/// Whole voxels low … high, both included.
struct Box {
  std::array<std::int32_t, 3> low, high;
};

/// Boxes that differ along `axis` only and touch there become one.
void join_along(std::size_t axis, std::vector<Box>& boxes) {
  const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
  const auto others = [b, c](const Box& box) {
    return std::array{box.low[b], box.high[b], box.low[c], box.high[c]};
  };
  std::sort(boxes.begin(), boxes.end(), [&](const Box& x, const Box& y) {
    const auto xs = others(x), ys = others(y);
    return xs != ys ? xs < ys : x.low[axis] < y.low[axis];
  });
  std::vector<Box> joined;
  for (const Box& box : boxes) {
    if (!joined.empty() && others(joined.back()) == others(box) &&
        joined.back().high[axis] + 1 >= box.low[axis])
      joined.back().high[axis] = std::max(joined.back().high[axis], box.high[axis]);
    else
      joined.push_back(box);
  }
  boxes = std::move(joined);
}

/// Free space from the plane to `depth` behind it.
bool open_through(const Surface& surface, const Eigen::Vector2d& uv, double depth,
                  const OccupancyView& octree) {
  // From below, where it is mostly unknown. Steps of d miss a voxel of which the line cuts a corner only.
  for (double down = depth; down > -octree.resolution(); down -= octree.resolution()) {
    const Eigen::Vector3d at(uv.x(), uv.y(), -std::max(down, 0.0));
    if (octree.at(surface.T_map_surface * at).state != OccupancyView::State::free) return false;
  }
  return true;
}

Ring2 project(const Surface& surface, const Box& box, double d) {
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

}  // namespace

std::vector<Eigen::Vector3d> voxels_over(const Surface& surface, const Eigen::Vector2d& low,
                                         const Eigen::Vector2d& high, const ContactLimits& limits,
                                         const OccupancyView& octree) {
  const double d = octree.resolution();
  const double half = d / 2 * surface.plane.normal.cwiseAbs().sum();  // of a voxel, along the normal
  const double from = limits.obstacle_from_m - half, to = limits.clearance_m + half;
  Eigen::AlignedBox3d box;
  for (unsigned corner = 0; corner < 8; ++corner)
    box.extend(surface.T_map_surface * Eigen::Vector3d((corner & 1u) != 0 ? high.x() : low.x(),
                                                       (corner & 2u) != 0 ? high.y() : low.y(),
                                                       (corner & 4u) != 0 ? to : from));
  box.min().array() -= d;
  box.max().array() += d;
  std::vector<Eigen::Vector3d> centres;
  octree.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    const double height = surface.plane.signed_distance(voxel.center);
    if (voxel.surface != surface.id && height > from && height < to) centres.push_back(voxel.center);
    return true;
  });
  return centres;
}

std::vector<Ring2> projected(const Surface& surface, std::span<const Eigen::Vector3d> centres, double d) {
  std::vector<Box> boxes;
  boxes.reserve(centres.size());
  for (const Eigen::Vector3d& centre : centres) {
    Box box{};
    for (unsigned axis = 0; axis < 3; ++axis)
      box.low[axis] = static_cast<std::int32_t>(std::floor(centre[axis] / d));
    box.high = box.low;
    boxes.push_back(box);
  }
  // Along the normal first: a column's voxels cover one another.
  Eigen::Index steepest = 0;
  surface.plane.normal.cwiseAbs().maxCoeff(&steepest);
  for (std::size_t step = 0; step < 3; ++step)
    join_along((static_cast<std::size_t>(steepest) + step) % 3, boxes);
  std::vector<Ring2> covered;
  covered.reserve(boxes.size());
  for (const Box& box : boxes) covered.push_back(project(surface, box, d));
  return covered;
}

std::vector<Ring2> gaps_in(const Surface& surface, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                           const ContactLimits& limits, const OccupancyView& octree) {
  std::vector<Ring2> gaps;
  const double cell = octree.resolution() / 2;
  if (cell <= 0) return gaps;
  for (double row = std::floor(low.y() / cell); row * cell < high.y(); ++row) {
    const double v = (row + 0.5) * cell;
    std::optional<std::vector<double>> edges;  // that cross the row; mostly nobody asks
    double begin = 0, end = 0;                 // of a run of free cells
    const auto close = [&] {
      if (end > begin)
        gaps.push_back({{begin * cell, row * cell},
                        {end * cell, row * cell},
                        {end * cell, (row + 1) * cell},
                        {begin * cell, (row + 1) * cell}});
      begin = end = 0;
    };
    for (double column = std::floor(low.x() / cell); column * cell < high.x(); ++column) {
      const double u = (column + 0.5) * cell;
      if (!open_through(surface, {u, v}, limits.gap_depth_m, octree)) continue;
      if (!edges) edges = crossings(surface.polygons, v);
      if ((std::lower_bound(edges->begin(), edges->end(), u) - edges->begin()) % 2 == 0) continue;
      if (column != end || end == begin) {
        close();
        begin = column;
      }
      end = column + 1;
    }
    close();
  }
  return gaps;
}

}  // namespace octosurf
