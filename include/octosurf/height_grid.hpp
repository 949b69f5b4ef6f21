#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <optional>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Heights of walkable surfaces over a grid of square cells, laid out as grid_map does: element (0, 0) is the
/// cell in the +x, +y corner, rows run against x and columns against y. NaN without a surface.
struct HeightGrid {
  double cell = 0;                                   ///< edge of a cell, m
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< of the whole grid: x, y
  Eigen::MatrixXf elevation;                         ///< m
  std::array<Eigen::MatrixXf, 3> normal;             ///< of the surface there: x, y, z
  Eigen::MatrixXd surface;                           ///< its id

  /// The middle of a cell: x, y.
  Eigen::Vector2d center_of(Eigen::Index row, Eigen::Index column) const {
    const Eigen::Vector2d from_corner(static_cast<double>(row) + 0.5, static_cast<double>(column) + 0.5);
    return center + cell * (Eigen::Vector2d(static_cast<double>(elevation.rows()),
                                            static_cast<double>(elevation.cols())) /
                                2 -
                            from_corner);
  }
};

/// Options of height_grid().
struct HeightGridOptions {
  double cell = 0;  ///< m; 0: the map's resolution
  /// From the map frame to the grid's, whose z is up: upright(up) (up.hpp).
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  double max_slope_rad = std::numbers::pi / 6;  ///< steeper surfaces are left out; below π/2
  std::optional<double> below;  ///< m: higher surfaces are left out, e.g. to show floors under tables
  Eigen::AlignedBox2d within;   ///< x, y: the grid covers no more; empty: everything
};

/// The highest surface at each cell's centre, the lower id on a tie. Cells begin at multiples of their size,
/// so that grids of one map align. The grid has no cells if no surface is level enough. Throws Error(usage)
/// for invalid options and for more than 2²⁴ cells. Cost: O(vertices and cells) of each surface.
HeightGrid height_grid(const Snapshot& snapshot, const HeightGridOptions& options = {});

}  // namespace octosurf
