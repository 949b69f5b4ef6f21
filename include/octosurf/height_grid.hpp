#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <optional>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Heights of what can be stepped on over a grid of square cells, laid out as grid_map does: element (0, 0)
/// is the cell in the +x, +y corner, rows go against x and columns against y. NaN where there is nothing.
struct HeightGrid {
  double cell = 0;                                   ///< edge of a cell, m
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  ///< of the whole grid: x, y
  Eigen::MatrixXf elevation;                         ///< m
  std::array<Eigen::MatrixXf, 3> normal;             ///< of the surface there: x, y, z
  Eigen::MatrixXf surface;                           ///< its id; a float holds every SurfaceId exactly

  /// The middle of a cell: x, y.
  Eigen::Vector2d center_of(Eigen::Index row, Eigen::Index column) const {
    const Eigen::Vector2d from_corner(static_cast<double>(row) + 0.5, static_cast<double>(column) + 0.5);
    return center + cell * (Eigen::Vector2d(static_cast<double>(elevation.rows()),
                                            static_cast<double>(elevation.cols())) /
                                2 -
                            from_corner);
  }
};

/// What height_grid() takes.
struct HeightGridOptions {
  double cell = 0;  ///< m; 0: the map's resolution
  /// From the map's frame to the grid's, whose z is up: upright(up) (up.hpp).
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  double max_slope_rad = std::numbers::pi / 6;  ///< steeper surfaces are left out; below π/2
  std::optional<double> below;  ///< m: what is higher is left out, so that floors under tables show
};

/// The highest surface at each cell's centre, the lower id where two are level. Cells begin at multiples of
/// their size, so that grids of one map fit each other. Without a surface that is level enough the grid has
/// no cells. Throws Error(usage) for options that make no sense and for more than 2²⁴ cells.
/// Cost: O(vertices · rows) of each surface and O(cells).
HeightGrid height_grid(const Snapshot& snapshot, const HeightGridOptions& options = {});

}  // namespace octosurf
