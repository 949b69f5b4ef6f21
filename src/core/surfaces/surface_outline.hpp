#pragma once

#include "sensing/noise_model.hpp"
#include "surfaces/outline_change.hpp"
#include "surfaces/plane_hash.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <tsl/robin_map.h>
#include <vector>

namespace octosurf::surfaces {

/// Outline points at intersections with other surfaces, by the cell of the inlier they are extended from.
using IntersectionSites =
    tsl::robin_map<std::uint64_t, std::vector<Eigen::Vector2d>, geometry::PackedKeyHash>;

/// The inliers' outline: an alpha shape of sites, which are all inliers, except those deep inside (all cells
/// within two of theirs occupied), which are replaced by a lattice of cells' centres; boundary points, with
/// noise; and intersections with other surfaces. It follows the changes of the inliers.
class SurfaceOutline : public PlaneHash {
 public:
  SurfaceOutline(const Eigen::Isometry3d& frame, double resolution);

  /// False only if no inlier was added or removed where the boundary could change.
  bool polygons_stale() const { return polygons_stale_; }
  /// As of derive() or a load; none after take_outline_change().
  const std::vector<Polygon>& polygons() const { return polygons_; }

  /// Takes the changes of the inliers; `noise` null: no boundary points. It changes the part of the raster
  /// that other surfaces read.
  void update_raster(double max_hole_size, const sensing::NoiseModel* noise);

  /// The end of the readings in an inlier's voxel toward the boundary of the surface at its cell: the inlier
  /// is the mean of readings that begin at the voxel's inner side, so they extend as far beyond it. Reduced
  /// by `edge_bleed` m, because noise carries readings over an edge. Inside the voxel, map frame; empty if it
  /// coincides with the inlier, its cell is not at a boundary, or the point is a voxel's centre for lack of
  /// readings.
  std::optional<Eigen::Vector3f> boundary_point(const Inlier& inlier, double edge_bleed) const;
  /// A point in the hash frame, in cells, rounded to the outline's quantum.
  Eigen::Vector2d outline_point(const Eigen::Vector3f& p) const;
  /// α for outline points: `max_hole_size` in cells, less the stretch by tilting.
  double outline_alpha(double max_hole_size) const { return max_hole_size * cos_largest_tilt / resolution(); }

  // As of the last change taken; none after a load.
  std::size_t outline_sites() const { return outline_ ? outline_->outline.sites() : 0; }
  std::vector<Eigen::Vector2d> intersection_sites() const;
  /// Assumed extent of readings beyond an edge, m, by range class; d, beyond the range of boundary points,
  /// before and without noise.
  using EdgeBleed = std::array<double, sensing::NoiseModel::classes>;
  const EdgeBleed& edge_bleed() const { return edge_bleed_; }

 protected:
  /// Largest angle of the hash frame to the plane. It shifts an outline's vertex by 1/57 of its inlier's
  /// distance from the plane, whatever the surface's extent: far less than a voxel. Rehashing costs O(n).
  static constexpr double cos_largest_tilt = 0.99984769515639;  // 1°

  /// The changes since the last call, and those to these intersections.
  OutlineChange take_change(SurfaceId id, const Eigen::Affine2d& T_surface_outline,
                            IntersectionSites intersections);
  /// All sites are inserted anew after it.
  void rehash(const Eigen::Isometry3d& frame);

  std::vector<Polygon> polygons_;

 private:
  std::optional<Eigen::Vector3d> outward(geometry::PlaneCell cell) const;
  void add_sites_of(geometry::PlaneCell cell, int spacing, std::vector<Eigen::Vector2d>& sites) const;

  std::map<std::uint64_t, std::uint64_t> changed_;  // bits of cells by tile, since the last take_change()
  std::shared_ptr<SharedOutline> outline_;          // null before the first update_raster()
  IntersectionSites intersections_;                 // as in the outline
  EdgeBleed edge_bleed_;
};

}  // namespace octosurf::surfaces
