#include "planning/cell_runs.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/height_grid.hpp>

namespace octosurf {
namespace {

using namespace planning;

constexpr double most_cells = 1 << 24;  // five layers of them take 336 MB

[[noreturn]] void refuse(const std::string& option, const std::string& rule) {
  throw Error(Error::Kind::usage, option, rule);
}

void check(const Snapshot& snapshot, const HeightGridOptions& options, double cell) {
  if (!(options.cell >= 0) || !std::isfinite(options.cell)) refuse("cell", "must be a length in metres");
  if (!snapshot.surfaces.empty() && !(cell > 0))
    refuse("cell", "must be given for a map without a resolution");
  if (!(options.max_slope_rad >= 0 && options.max_slope_rad < std::numbers::pi / 2))
    refuse("max_slope", "of a height grid must be in [0, 90) degrees: a wall has no height over a cell");
  if (options.below && !std::isfinite(*options.below)) refuse("below", "must be a height in metres");
}

Eigen::Vector3d turned(const Surface& surface, const Eigen::Vector2d& uv, const Eigen::Quaterniond& turn) {
  const Eigen::Vector3d p = turn * surface.to_map(uv);
  if (!p.allFinite())
    throw Error(Error::Kind::data, "surface " + std::to_string(surface.id),
                "holds a number that is not finite", "build the map anew from its scans");
  return p;
}

HeightGrid empty_grid(const Eigen::AlignedBox2d& box, double cell) {
  HeightGrid grid;
  grid.cell = cell;
  Eigen::Vector2d low = (box.min() / cell).array().floor(), high = (box.max() / cell).array().ceil();
  high = high.cwiseMax(low + Eigen::Vector2d::Ones());
  const Eigen::Vector2d cells = high - low;
  if (!(cells.prod() <= most_cells))
    throw Error(Error::Kind::usage, "cell", "of " + std::to_string(cell) + " m gives more than 2^24 cells",
                "give a larger one");
  grid.center = cell * (low + high) / 2;
  const float nothing = std::numeric_limits<float>::quiet_NaN();
  const auto rows = static_cast<Eigen::Index>(cells.x()), columns = static_cast<Eigen::Index>(cells.y());
  grid.elevation = Eigen::MatrixXf::Constant(rows, columns, nothing);
  grid.surface = grid.elevation.cast<double>();
  grid.normal.fill(grid.elevation);
  return grid;
}

/// Paints a surface over the cells that it covers seen from above, where nothing is higher.
void paint(const Surface& surface, const HeightGridOptions& options, HeightGrid& grid) {
  const Eigen::Index rows = grid.elevation.rows(), columns = grid.elevation.cols();
  const Eigen::Vector2d low = grid.center - grid.cell * Eigen::Vector2d(rows, columns) / 2;
  std::vector<Polygon> outline = surface.polygons;
  for_each_ring(outline, [&](Ring2& ring) {
    for (Eigen::Vector2d& p : ring) p = turned(surface, p, options.turn).head<2>() - low;
  });
  const Eigen::Vector3d n = options.turn * surface.plane.normal;
  CellRuns(outline, grid.cell).for_each_run([&](Eigen::Index y, Eigen::Index from, Eigen::Index to) {
    if (y < 0 || y >= columns) return;
    for (Eigen::Index x = std::max<Eigen::Index>(from, 0); x < std::min(to, rows); ++x) {
      const Eigen::Index row = rows - 1 - x, column = columns - 1 - y;  // they run against x and y
      const double z = (surface.plane.offset - n.head<2>().dot(grid.center_of(row, column))) / n.z();
      float& elevation = grid.elevation(row, column);
      if ((options.below && z > *options.below) || static_cast<float>(z) <= elevation) continue;
      elevation = static_cast<float>(z);
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        grid.normal[static_cast<std::size_t>(axis)](row, column) = static_cast<float>(n[axis]);
      grid.surface(row, column) = static_cast<double>(surface.id);
    }
  });
}

}  // namespace

HeightGrid height_grid(const Snapshot& snapshot, const HeightGridOptions& options) {
  const double cell = options.cell > 0 ? options.cell : snapshot.resolution;
  check(snapshot, options, cell);
  std::vector<SurfacePtr> level;
  Eigen::AlignedBox2d box;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if ((options.turn * surface->plane.normal).z() < std::cos(options.max_slope_rad)) continue;
    level.push_back(surface);
    for (const Polygon& polygon : surface->polygons)
      for (const Eigen::Vector2d& p : polygon.outer) box.extend(turned(*surface, p, options.turn).head<2>());
  }
  if (!options.within.isEmpty()) box = box.intersection(options.within);
  if (box.isEmpty()) {
    HeightGrid nothing;
    nothing.cell = cell;
    return nothing;
  }
  HeightGrid grid = empty_grid(box, cell);
  for (const SurfacePtr& surface : level) paint(*surface, options, grid);
  return grid;
}

}  // namespace octosurf
