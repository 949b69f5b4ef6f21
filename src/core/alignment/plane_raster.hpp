#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::alignment {

/// The inside of a surface's polygons as bits: cells of its plane that lie in them with the centres of their
/// eight neighbours. The boundary is excluded, because readings near an edge mix both its sides.
class PlaneRaster {
 public:
  /// Covers `window`; beyond it nothing is set. O(cells in the window / 64 + vertices + length of the rings
  /// beside the window / edge).
  PlaneRaster(const std::vector<Polygon>& polygons, double edge, const Eigen::AlignedBox2d& window);

  bool covers(double u, double v) const {
    const double column = (u - corner_.x()) * per_edge_ - window_.first.x(),
                 row = (v - corner_.y()) * per_edge_ - window_.first.y();
    if (!(column >= 0 && row >= 0 && column < window_.size.x() && row < window_.size.y())) return false;
    const auto c = static_cast<std::size_t>(column), r = static_cast<std::size_t>(row);
    return (bits_[r * words_ + c / 64] >> (c % 64) & 1) != 0;
  }
  /// Within `reach` of the polygons' box.
  bool near(const Eigen::Vector2d& uv, double reach) const {
    const Eigen::Array2d at = (uv - corner_).array();
    return (at >= -reach).all() && (at <= cells_ / per_edge_ + reach).all();
  }
  /// Whether the raster covers `window`.
  bool holds(const Eigen::AlignedBox2d& window) const;

 private:
  struct Window {  ///< columns and rows: whole numbers, stored as doubles
    Eigen::Array2d first = Eigen::Array2d::Zero(), size = Eigen::Array2d::Zero();
  };
  Window window_of(const Eigen::AlignedBox2d& box) const;
  void fill(const std::vector<Polygon>& polygons, std::vector<std::uint64_t>& bits) const;
  void erode(const std::vector<std::uint64_t>& filled);

  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double per_edge_ = 1;
  Eigen::Array2d cells_ = Eigen::Array2d::Zero();  // columns and rows of the polygons' box
  Window window_;
  std::size_t words_ = 0;  // of a row
  std::vector<std::uint64_t> bits_;
};

}  // namespace octosurf::alignment
