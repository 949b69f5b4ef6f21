#include "cylinders/seen_through.hpp"

#include <algorithm>

namespace octosurf::cylinders {

SurfaceId SeenThrough::operator()(PointId point) {
  const std::size_t i = index_of(point);
  if (i >= answers_.size()) answers_.resize(std::max(map_.window.size(), i + 1), unknown);
  if (answers_[i] == unknown) answers_[i] = in_front_of(map_.window[point]);
  return answers_[i];
}

/// In the point's block and adjacent ones: within eight voxels.
const SeenThrough::Surfaces& SeenThrough::near(geometry::VoxelKey key) {
  const auto [entry, fresh] = near_.try_emplace(key.packed() & blocks);
  Surfaces& surfaces = entry.value();
  if (fresh)
    for (const SurfaceId id : map_.surfaces.near(key, 8)) surfaces.push_back(map_.surfaces.find(id));
  return surfaces;
}

SurfaceId SeenThrough::in_front_of(const occupancy::VoxelPoint& p) {
  constexpr double farthest = 0.3;  // m; deeper than any noise of a surface
  const double depth = std::min(farthest, 2.5 * map_.noise.tolerance(p.range_class));
  for (const surfaces::SurfaceModel* surface : near(p.key)) {
    const double behind = -surface->distance(p.position);
    if (behind <= 0 || behind > depth) continue;
    const auto facing = static_cast<float>(surface->plane().normal.dot(p.view.cast<double>()));
    if (facing < 0.2F) continue;
    const Eigen::Vector3f crossing = p.position + p.view * (static_cast<float>(behind) / facing);
    const geometry::PlaneCell cell = surface->cell_of(crossing);
    // At the surface's border three of nine cells are missing. Points seen past its edge are not its noise.
    int around = 0;
    for (int v = -1; v <= 1; ++v)
      for (int u = -1; u <= 1; ++u) around += surface->covers({cell.u + u, cell.v + v});
    if (around >= 7) return surface->id();
  }
  return 0;
}

}  // namespace octosurf::cylinders
