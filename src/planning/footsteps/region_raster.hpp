#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::footsteps {

/// Points of a raster along a side of a search cell.
inline constexpr int pixels_per_cell = 4;

inline int cell_of_pixel(int pixel) {
  return pixel >= 0 ? pixel / pixels_per_cell : ~(~pixel / pixels_per_cell);
}

/// Polygons of a plane rasterised from above: grid points inside them, with their distance from the rings.
class RegionRaster {
 public:
  /// `T`: the polygons' (u, v) to the walking frame, of which x and y are used. Distances are capped at
  /// `cap`, but not below a pixel.
  RegionRaster(const std::vector<Polygon>& polygons, const Eigen::Isometry3d& T, double pixel, double cap);

  bool empty() const { return width_ == 0; }
  /// Pixel (x, y) is the point ((x + ½) pixel, (y + ½) pixel); x0 … x0 + width − 1.
  int x0() const { return x0_; }
  int y0() const { return y0_; }
  int width() const { return width_; }
  int height() const { return height_; }
  double pixel() const { return pixel_; }

  bool inside(int x, int y) const { return depth(x, y) > 0; }
  /// m from the pixel's point to the nearest point outside, too small by up to a pixel; 0 outside.
  float depth(int x, int y) const {
    if (x < x0_ || y < y0_ || x >= x0_ + width_ || y >= y0_ + height_) return 0;
    return depth_[static_cast<std::size_t>(y - y0_) * static_cast<std::size_t>(width_) +
                  static_cast<std::size_t>(x - x0_)];
  }

 private:
  void fill(const std::vector<Polygon>& polygons, const Eigen::Matrix2d& A, const Eigen::Vector2d& t);
  void measure(double cap);

  double pixel_;
  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
  std::vector<float> depth_;
};

}  // namespace octosurf::footsteps
