#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// The inside of a surface's polygons as bits: cells of its plane whose eight neighbours' centres, too, lie
/// in them. The rim is left out, because readings near an edge mix what lies on both its sides.
class PlaneRaster {
 public:
  /// O(cells in the polygons' box / 64 + rings' length / edge).
  PlaneRaster(const std::vector<Polygon>& polygons, double edge);

  bool covers(double u, double v) const {
    const double column = (u - corner_.x()) * per_edge_, row = (v - corner_.y()) * per_edge_;
    if (!(column >= 0 && row >= 0 && column < columns_ && row < rows_)) return false;
    const auto c = static_cast<std::size_t>(column), r = static_cast<std::size_t>(row);
    return (bits_[r * words_ + c / 64] >> (c % 64) & 1) != 0;
  }
  /// Within `reach` of the polygons' box.
  bool near(const Eigen::Vector2d& uv, double reach) const {
    const Eigen::Array2d at = (uv - corner_).array();
    return (at >= -reach).all() && (at <= Eigen::Array2d(columns_, rows_) / per_edge_ + reach).all();
  }

 private:
  void fill(const std::vector<Polygon>& polygons, std::vector<std::uint64_t>& bits) const;
  void erode(const std::vector<std::uint64_t>& filled);

  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double per_edge_ = 1;
  double columns_ = 0, rows_ = 0;  // whole numbers; compared with doubles
  std::size_t words_ = 0;          // of a row
  std::vector<std::uint64_t> bits_;
};

}  // namespace octosurf
