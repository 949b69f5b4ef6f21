#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {
class SurfaceModel;
}  // namespace octosurf::surfaces

namespace octosurf::alignment {

/// The inside of a surface as bits: cells of its plane that lie in it with the centres of their eight
/// neighbours. The boundary is excluded, because readings near an edge mix both its sides. Covers `window`;
/// beyond it nothing is set.
class PlaneRaster {
 public:
  /// Of published polygons. O(cells in the window / 64 + vertices + length of the rings beside the window /
  /// edge).
  PlaneRaster(const std::vector<Polygon>& polygons, double edge, const Eigen::AlignedBox2d& window);
  /// Of a surface of the map under construction: of the cells of its plane hash, with gaps up to about
  /// `max_hole_size` closed, so that no polygons are needed. `T_surface_map`: to the frame of (u, v). O(tiles
  /// + cells in the window).
  PlaneRaster(const surfaces::SurfaceModel& surface, const Eigen::Isometry3d& T_surface_map,
              double max_hole_size, double edge, const Eigen::AlignedBox2d& window);

  bool covers(double u, double v) const {
    const double column = (u - corner_.x()) * per_edge_ - window_.first.x(),
                 row = (v - corner_.y()) * per_edge_ - window_.first.y();
    if (!(column >= 0 && row >= 0 && column < window_.size.x() && row < window_.size.y())) return false;
    const auto c = static_cast<std::size_t>(column), r = static_cast<std::size_t>(row);
    return (bits_[r * words_ + c / 64] >> (c % 64) & 1) != 0;
  }
  /// Within `reach` of the surface's box.
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
  void set_grid(const Eigen::AlignedBox2d& box, double edge, int beyond);
  Window window_of(const Eigen::AlignedBox2d& box, int beyond = 1) const;
  void cover(const Window& window);
  void fill(const std::vector<Polygon>& polygons);
  template <class Combine>
  void combine_neighbours(const Combine& combine);

  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double per_edge_ = 1;
  Eigen::Array2d cells_ = Eigen::Array2d::Zero();  // columns and rows of the surface's box
  Window window_, held_;                           // of the bits, and the part that is complete
  std::size_t words_ = 0;                          // of a row
  std::vector<std::uint64_t> bits_;
};

}  // namespace octosurf::alignment
