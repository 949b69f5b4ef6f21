#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::footsteps {

/// Points of a raster along a side of a search cell.
inline constexpr int pixels_per_cell = 4;

/// Polygons of a plane rasterised from above: grid points inside them, with their distance from the rings.
class RegionRaster {
 public:
  /// `T`: the polygons' (u, v) to the walking frame, of which x and y are used. Distances are capped at
  /// `cap`; 0: none are measured.
  RegionRaster(const std::vector<Polygon>& polygons, const Eigen::Isometry3d& T, double pixel, double cap);

  Eigen::Array2i first_cell() const { return first_; }
  Eigen::Array2i cells() const { return cells_; }  ///< columns and rows; 0: no polygons
  /// Pixel (x, y), in one of the cells.
  Eigen::Vector2d point(int x, int y) const { return {(x + 0.5) * pixel_, (y + 0.5) * pixel_}; }
  double pixel() const { return pixel_; }
  /// m from the pixel's point to the nearest point outside, too small by up to a pixel; 0 outside.
  float depth(int x, int y) const {
    return depth_[static_cast<std::size_t>(y - first_.y() * pixels_per_cell) * cells_.x() * pixels_per_cell +
                  static_cast<std::size_t>(x - first_.x() * pixels_per_cell)];
  }

 private:
  double pixel_;
  Eigen::Array2i first_ = Eigen::Array2i::Zero(), cells_ = Eigen::Array2i::Zero();
  std::vector<float> depth_;
};

/// A number for each cell of a raster.
struct CellNumbers {
  Eigen::Array2i first = Eigen::Array2i::Zero(), size = Eigen::Array2i::Zero();
  std::vector<std::int32_t> numbers;

  CellNumbers() = default;
  CellNumbers(const RegionRaster& raster, std::int32_t number)
      : first(raster.first_cell()),
        size(raster.cells()),
        numbers(static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()), number) {}
  bool holds(int x, int y) const {
    return x >= first.x() && y >= first.y() && x < first.x() + size.x() && y < first.y() + size.y();
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - first.y()) * static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(x - first.x());
  }
  std::int32_t& at(int x, int y) { return numbers[index(x, y)]; }
  std::int32_t at(int x, int y) const { return numbers[index(x, y)]; }
};

}  // namespace octosurf::footsteps
