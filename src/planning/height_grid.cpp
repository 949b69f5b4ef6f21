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

constexpr double most_cells = 1 << 24;  // five layers of them take 336 MB

/// A surface projected from above: rings of (y, x), so that a line of constant x is crossings()' constant v.
struct SeenFromAbove {
  SurfaceId id;
  Plane plane;
  std::vector<Polygon> polygons;
};

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

SeenFromAbove seen_from_above(const Surface& surface, const Eigen::Quaterniond& turn) {
  SeenFromAbove seen{surface.id, {turn * surface.plane.normal, surface.plane.offset}, {}};
  const auto project = [&](const Ring2& ring) {
    Ring2 projected;
    projected.reserve(ring.size());
    for (const Eigen::Vector2d& uv : ring) {
      const Eigen::Vector3d p = turn * surface.to_map(uv);
      if (!p.allFinite())
        throw Error(Error::Kind::data, "surface " + std::to_string(surface.id),
                    "holds a number that is not finite", "build the map anew from its scans");
      projected.emplace_back(p.y(), p.x());
    }
    return projected;
  };
  for (const Polygon& polygon : surface.polygons) {
    Polygon& projected = seen.polygons.emplace_back();
    projected.outer = project(polygon.outer);
    for (const Ring2& hole : polygon.holes) projected.holes.push_back(project(hole));
  }
  return seen;
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
  grid.surface = grid.elevation;
  grid.normal.fill(grid.elevation);
  return grid;
}

class Painter {
 public:
  Painter(HeightGrid& grid, std::optional<double> below) : grid_(grid), below_(below) {}

  void paint(const SeenFromAbove& surface) const {
    for (const Polygon& polygon : surface.polygons) {
      const auto [low, high] =
          std::minmax_element(polygon.outer.begin(), polygon.outer.end(),
                              [](const auto& a, const auto& b) { return a.y() < b.y(); });
      if (low == polygon.outer.end()) continue;
      // Rows run against x: the first has the largest.
      const Eigen::Index last = grid_.elevation.rows() - 1;
      const Eigen::Index from = std::clamp<Eigen::Index>(row_of(high->y()), 0, last);
      const Eigen::Index to = std::clamp<Eigen::Index>(row_of(low->y()), 0, last);
      for (Eigen::Index row = from; row <= to; ++row) paint_row(surface, polygon, row);
    }
  }

 private:
  Eigen::Index row_of(double x) const {
    return static_cast<Eigen::Index>(
        std::floor((grid_.center.x() - x) / grid_.cell + static_cast<double>(grid_.elevation.rows()) / 2));
  }
  /// The first column whose centre is not beyond y; columns run against y.
  Eigen::Index column_not_beyond(double y) const {
    const double of_center =
        (grid_.center.y() - y) / grid_.cell + static_cast<double>(grid_.elevation.cols()) / 2 - 0.5;
    return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::ceil(of_center)), 0,
                                    grid_.elevation.cols());
  }
  void paint_row(const SeenFromAbove& surface, const Polygon& polygon, Eigen::Index row) const {
    const double x = grid_.center_of(row, 0).x();
    const std::vector<double> ys = planning::crossings(polygon, x);
    for (std::size_t i = 0; i + 1 < ys.size(); i += 2)
      for (Eigen::Index column = column_not_beyond(ys[i + 1]); column < column_not_beyond(ys[i]); ++column)
        paint_cell(surface, row, column);
  }
  void paint_cell(const SeenFromAbove& surface, Eigen::Index row, Eigen::Index column) const {
    const Eigen::Vector2d at = grid_.center_of(row, column);
    const Eigen::Vector3d& n = surface.plane.normal;
    const double z = (surface.plane.offset - n.head<2>().dot(at)) / n.z();
    float& elevation = grid_.elevation(row, column);
    if ((below_ && z > *below_) || static_cast<float>(z) <= elevation) return;
    elevation = static_cast<float>(z);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      grid_.normal[static_cast<std::size_t>(axis)](row, column) = static_cast<float>(n[axis]);
    grid_.surface(row, column) = static_cast<float>(surface.id);
  }

  HeightGrid& grid_;
  std::optional<double> below_;
};

}  // namespace

HeightGrid height_grid(const Snapshot& snapshot, const HeightGridOptions& options) {
  const double cell = options.cell > 0 ? options.cell : snapshot.resolution;
  check(snapshot, options, cell);
  std::vector<SeenFromAbove> level;
  Eigen::AlignedBox2d box;
  for (const SurfacePtr& surface : snapshot.surfaces) {
    if ((options.turn * surface->plane.normal).z() < std::cos(options.max_slope_rad)) continue;
    level.push_back(seen_from_above(*surface, options.turn));
    for (const Polygon& polygon : level.back().polygons)
      for (const Eigen::Vector2d& yx : polygon.outer) box.extend(yx.reverse().eval());
  }
  if (!options.within.isEmpty()) box = box.intersection(options.within);
  if (box.isEmpty()) {
    HeightGrid nothing;
    nothing.cell = cell;
    return nothing;
  }
  HeightGrid grid = empty_grid(box, cell);
  const Painter painter(grid, options.below);
  for (const SeenFromAbove& surface : level) painter.paint(surface);
  return grid;
}

}  // namespace octosurf
