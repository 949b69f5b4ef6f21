#pragma once

#include "geometry/cell_bits.hpp"
#include "geometry/morton.hpp"
#include "surfaces/inlier_tiles.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <utility>
#include <vector>

namespace octosurf::surfaces {

/// A surface's inliers in a 2-D hash over its plane: each is in the cell that contains its position in the
/// hash frame, which follows the plane coarsely.
class PlaneHash {
 public:
  PlaneHash(const Eigen::Isometry3d& frame, double resolution);

  double resolution() const { return resolution_; }
  const Eigen::Isometry3d& hash_frame() const { return frame_; }

  /// The cell of a point in the plane.
  geometry::PlaneCell cell_of(const Eigen::Vector3f& p) const;
  bool occupied(geometry::PlaneCell cell) const { return raster_.occupied(cell); }
  /// Raster equivalent of "inside the polygon": the cell has an inlier, or five of its neighbours do.
  bool covers(geometry::PlaneCell cell) const { return occupied(cell) || neighbours(cell) >= 5; }
  /// All eight neighbours have inliers.
  bool surrounded(geometry::PlaneCell cell) const { return neighbours(cell) == 8; }
  /// The nearest cell with an inlier, at most `reach` cells off.
  std::optional<geometry::PlaneCell> nearest(geometry::PlaneCell cell, int reach) const;
  /// The place at (u, v) in cells, map frame, on the hash frame's plane, which is within one degree of the
  /// surface's.
  Eigen::Vector3d place_of(const Eigen::Vector2d& uv) const;
  Eigen::Vector3d centre_of(geometry::PlaneCell cell) const { return place_of({cell.u + 0.5, cell.v + 0.5}); }
  /// From cells to (u, v) in a surface frame, along the frame's normal: of a place on the hash frame's plane.
  Eigen::Affine2d T_frame_cells(const Eigen::Isometry3d& T_frame_map) const;

  const geometry::CellBits& raster() const { return raster_; }
  const InlierTiles& inliers() const { return inliers_; }
  template <class Visit>
  void for_each_inlier(Visit&& visit) const {  ///< in no particular order
    inliers_.for_each(std::forward<Visit>(visit));
  }
  /// Inliers in key order; O(n log n).
  std::vector<Inlier> sorted_inliers() const;

 protected:
  static constexpr std::uint32_t ring = 0b00000'01110'01010'01110'00000;  ///< neighbours, of raster_.around()
  void insert(const Inlier& inlier);
  /// `position` must be the one it was added with. None if it is not an inlier.
  std::optional<Inlier> take_out(geometry::VoxelKey key, const Eigen::Vector3f& position);
  /// Puts all inliers into the cells of another frame.
  void rehash(const Eigen::Isometry3d& frame);

  geometry::CellBits raster_;
  bool polygons_stale_ = true;  // an inlier came or went, but not deep inside (paper III-B)

 private:
  /// Number with inliers.
  unsigned neighbours(geometry::PlaneCell cell) const {
    return geometry::bit_count(raster_.around(cell) & ring);
  }

  double resolution_;
  Eigen::Isometry3d frame_;
  Eigen::Matrix<float, 2, 3> axes_;  // rows: u and v axis / d
  InlierTiles inliers_;
};

}  // namespace octosurf::surfaces
