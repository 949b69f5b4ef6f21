#include "planning/contact_cells.hpp"

#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "planning/unknown_space.hpp"
#include "planning/voxel_matter.hpp"

#include <utility>

namespace octosurf::planning {
namespace {

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

/// What a cube of edge d covers of the plane, about the place of its middle.
Ring2 cover_of_cube(const Surface& surface, double d) {
  Ring2 corners;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d p;
    for (unsigned axis = 0; axis < 3; ++axis) p[axis] = (corner >> axis & 1u) != 0 ? d / 2 : -d / 2;
    corners.emplace_back((surface.T_map_surface.linear().transpose() * p).head<2>());
  }
  return convex_hull(std::move(corners));
}

/// A flat voxel covers a rectangle along the intersection of its plane with this one.
Ring2 cover_of(const VoxelMatter& matter, const Surface& surface) {
  const Eigen::Matrix<double, 3, 2> uv = surface.T_map_surface.linear().leftCols<2>();
  const Eigen::Vector2d along = intersection_line(uv, matter.normal), across(-along.y(), along.x()),
                        middle = uv.transpose() * (matter.middle - surface.T_map_surface.translation()),
                        half = matter.reach(uv * along) * along, side = matter.reach(uv * across) * across;
  return {middle - half - side, middle + half - side, middle + half + side, middle - half + side};
}

Ring2 moved(Ring2 ring, const Eigen::Vector2d& by) {
  for (Eigen::Vector2d& p : ring) p += by;
  return ring;
}

void mark_obstacles(const Surface& surface, const ContactLimits& limits, const OccupancyView& octree,
                    const Snapshot* others, BitRaster& cells) {
  const double d = octree.resolution();
  // The corners of a rectangle are √2 times as far off as its reach, plus rounding.
  const Eigen::AlignedBox3d box =
      box_about(box_over(surface.T_map_surface, cells.box(), limits.obstacle_from_m, limits.clearance_m),
                2 * MatterOfVoxels::farthest_reach * d + MatterOfVoxels::farthest_move);
  const Ring2 cube = cover_of_cube(surface, d);
  const Eigen::Isometry3d T_surface_map = surface.T_map_surface.inverse();
  MatterOfVoxels matter_of(others, d);
  octree.for_each_occupied(box, [&](const OccupancyView::Voxel& voxel) {
    if (voxel.surface == surface.id) return true;
    const VoxelMatter matter = matter_of(voxel);
    const double height = surface.plane.signed_distance(matter.middle);
    const double half = matter.reach(surface.plane.normal);
    if (height + half <= limits.obstacle_from_m || height - half >= limits.clearance_m) return true;
    cells.mark(matter.flat() ? cover_of(matter, surface)
                             : moved(cube, (T_surface_map * matter.middle).head<2>()));
    return true;
  });
}

void mark_unknown(const Surface& surface, const ContactLimits& limits, const OccupancyView& octree,
                  BitRaster& cells) {
  constexpr double patch = 32;  // voxels: boxes about patches of a slope hold little beside its slab
  const double d = octree.resolution();
  if (d <= 0) return;  // an empty view
  const double half = d / 2 * surface.plane.normal.lpNorm<1>();
  const Ring2 cube = cover_of_cube(surface, d);
  const Eigen::Isometry3d T_surface_map = surface.T_map_surface.inverse();
  // Voxels that follow one another along x are marked together.
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> run;
  const auto mark_run = [&] {
    if (!run) return;
    Ring2 ends = moved(cube, (T_surface_map * run->first).head<2>());
    for (const Eigen::Vector2d& p : cube) ends.push_back((T_surface_map * run->second).head<2>() + p);
    cells.mark(convex_hull(std::move(ends)));
    run.reset();
  };
  const Eigen::Vector2d low = cells.box().min(), high = cells.box().max();
  for (double u = low.x(); u <= high.x(); u += patch * d)
    for (double v = low.y(); v <= high.y(); v += patch * d) {
      const Eigen::Vector2d from(u, v), to = (from.array() + patch * d).min(high.array());
      const Eigen::AlignedBox3d box =
          box_over(surface.T_map_surface, {from, to}, limits.obstacle_from_m, limits.unknown_to_m);
      for_each_unknown(octree, box_about(box, MatterOfVoxels::farthest_reach * d),
                       [&](const Eigen::Vector3d& centre) {
                         const double height = surface.plane.signed_distance(centre);
                         if (!(height + half > limits.obstacle_from_m && height - half < limits.unknown_to_m))
                           return;
                         if (run && !(centre - run->second).isApprox(Eigen::Vector3d(d, 0, 0), 1e-6))
                           mark_run();
                         if (!run) run.emplace(centre, centre);
                         run->second = centre;
                       });
      mark_run();
    }
}

}  // namespace

ContactCells::ContactCells(const Surface& surface, const Eigen::AlignedBox2d& box,
                           const Eigen::AlignedBox2d& near, double edge, const ContactLimits& limits,
                           const OccupancyView* octree, const Snapshot* others)
    : outside(box, edge), obstacles(near, edge), unknown(obstacles) {
  if (limits.clearance_m > 0) mark_obstacles(surface, limits, *octree, others, obstacles);
  if (limits.unknown_to_m > 0) mark_unknown(surface, limits, *octree, unknown);
  outside.mark_outside(surface.polygons);
}

}  // namespace octosurf::planning
