#include "geometry/even_odd.hpp"
#include "planning/column.hpp"
#include "planning/contact_shape.hpp"
#include "planning/ground_tiles.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <utility>

#include <octosurf/gaps.hpp>

namespace octosurf {

GroundedSurface find_gaps(const Surface& surface, const OccupancyView& octree, double widest_bridged_m) {
  const auto mapped = std::make_shared<const Surface>(surface);
  if (octree.resolution() <= 0) return {mapped, {}};
  const planning::GroundTiles ground(mapped, octree.resolution(), widest_bridged_m);
  return {ground.solid(octree), ground.gaps(octree)};
}

std::shared_ptr<const Snapshot> with_gaps(const Snapshot& snapshot, const OccupancyView& octree,
                                          double widest_bridged_m,
                                          std::map<SurfaceId, std::vector<Gap>>* gaps) {
  auto result = std::make_shared<Snapshot>(snapshot);
  for (SurfacePtr& surface : result->surfaces) {
    GroundedSurface found = find_gaps(*surface, octree, widest_bridged_m);
    surface = std::move(found.surface);
    if (gaps != nullptr && !found.gaps.empty()) (*gaps)[surface->id] = std::move(found.gaps);
  }
  return result;
}

double widest_unseen_of(const ContactShape& shape, double share) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : shape.outline) box.extend(p);
  return share * (box.isEmpty() ? 2 * shape.radius : box.sizes().minCoeff());
}

Ground ground_at(const Surface& surface, const OccupancyView& octree, const Eigen::Vector2d& uv) {
  for (const Polygon& polygon : surface.polygons)
    if (planning::contains(polygon, uv)) return Ground::supported;
  if (octree.resolution() <= 0) return Ground::unseen;
  const planning::GroundPlane plane{surface.id, octree.resolution(), surface.rms_m, surface.T_map_surface};
  const planning::Columns::Seen seen = planning::Columns(octree, plane, Eigen::AlignedBox2d(uv)).at(uv);
  return seen.open ? Ground::open : seen.blocked ? Ground::blocked : Ground::unseen;
}

std::array<double, ground_names.size()> ground_under(const Surface& surface, const OccupancyView& octree,
                                                     const ContactShape& shape,
                                                     const Eigen::Isometry3d& T_map_contact) {
  std::array<double, ground_names.size()> shares{};
  const Ring2 outline = shape.outline.empty() ? planning::around_disc(shape.radius) : shape.outline;
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : outline) box.extend(p);
  const Eigen::Isometry3d T_surface_contact = surface.T_map_surface.inverse() * T_map_contact;
  // Effort: any size may be given. At least nine points.
  constexpr double samples_along = 64;
  const double narrow_side = box.sizes().minCoeff(), half_of_voxel = octree.resolution() / 2;
  const double step = std::max(half_of_voxel > 0 ? std::min(half_of_voxel, narrow_side / 3) : narrow_side / 3,
                               box.sizes().maxCoeff() / samples_along);
  double sum = 0;
  for (double y = box.min().y() + step / 2; y < box.max().y(); y += step)
    for (double x = box.min().x() + step / 2; x < box.max().x(); x += step) {
      if (!geometry::inside(outline, {x, y})) continue;
      const Eigen::Vector2d uv = (T_surface_contact * Eigen::Vector3d(x, y, 0)).head<2>();
      ++shares[static_cast<std::size_t>(ground_at(surface, octree, uv))];
      ++sum;
    }
  for (double& share : shares) share /= std::max(1.0, sum);
  return shares;
}

}  // namespace octosurf
