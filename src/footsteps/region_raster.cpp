#include "footsteps/region_raster.hpp"

#include "planning/cell_raster.hpp"
#include "planning/cell_runs.hpp"
#include "planning/rings.hpp"

#include <algorithm>

namespace octosurf::footsteps {

RegionRaster::RegionRaster(const std::vector<Polygon>& polygons, const Eigen::Isometry3d& T, double pixel,
                           double cap)
    : pixel_(pixel) {
  std::vector<Polygon> seen = polygons;
  planning::for_each_ring(seen, [&](Ring2& ring) {
    for (Eigen::Vector2d& p : ring) p = (T * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>();
  });
  const planning::CellRuns runs(seen, pixel);
  if (runs.box().isEmpty()) return;
  // Whole cells, with a pixel outside on every side.
  const double cell = pixel * pixels_per_cell;
  first_ = ((runs.box().min().array() - pixel) / cell).floor().cast<int>();
  cells_ = ((runs.box().max().array() + pixel) / cell).floor().cast<int>() - first_ + 1;
  const planning::CellRaster raster(first_ * pixels_per_cell, (first_ + cells_) * pixels_per_cell, pixel);
  planning::Mask mask(raster.cells(), 0);
  runs.mark(raster, false, mask);
  if (cap == 0) {
    depth_.assign(mask.begin(), mask.end());
    return;
  }
  // The edge runs somewhere between the last point inside and the first outside.
  depth_ = raster.depth_in(mask);
  for (float& depth : depth_)
    if (depth > 0) depth = std::min((depth - 0.5F) * static_cast<float>(pixel), static_cast<float>(cap));
}

}  // namespace octosurf::footsteps
