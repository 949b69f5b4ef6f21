#pragma once

#include "geometry/cell_bits.hpp"
#include "geometry/moments.hpp"
#include "geometry/outline.hpp"
#include "geometry/plane_frame.hpp"
#include "occupancy/occupancy_map.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/inlier_tiles.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <tsl/robin_map.h>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {

class SurfaceStore;

/// A surface's outline, for the thread that makes its polygons.
struct SharedOutline {
  SharedOutline(double alpha, memory::PageFile* file) : outline(alpha, file) {}
  geometry::Outline outline;
  std::vector<Polygon> polygons;  ///< as of the last update, in cells
  bool broken = false;            ///< an update failed
};

/// What has changed in a surface's outline: it may be applied later, and by another thread.
struct OutlineChange {
  struct Cell {
    geometry::PlaneCell cell;
    std::uint32_t sites;  ///< number of those it has now
  };
  SurfaceId id = 0;
  std::shared_ptr<SharedOutline> outline;
  Eigen::Affine2d T_surface_outline;   ///< from cells to (u, v)
  std::vector<Cell> cells;             ///< each once
  std::vector<Eigen::Vector2d> sites;  ///< of the cells, in their order
};

/// Applies a change, after all earlier ones of the same outline; (u, v). If it throws, it can be applied
/// again.
std::vector<Polygon> polygons_with(const OutlineChange& change);

/// The working form of a surface: its inliers in a 2-D hash over its plane, running moments of them by range
/// class, plane, pose, and cached derived data.
///
/// 1. Every inlier is in the cell that contains its position (in `hash_frame`).
/// 2. Moments are the sums over exactly the inliers (up to rounding).
/// 3. `polygons_stale()` is false only if no inlier was added or removed where the boundary could change.
class SurfaceModel {
 public:
  /// Repeated observations of the inliers' voxels, besides the point stored in each voxel. They make the
  /// plane more exact, because a voxel that noise reached only once has little weight in these sums.
  struct Evidence {
    geometry::Moments moments;  ///< about reference(), weighted like an inlier of the nearest class
    double readings = 0;        ///< number of voxel observations added
  };

  /// `file`: where what grows with it is kept, if not on the heap.
  SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution,
               memory::PageFile* file = nullptr);

  SurfaceId id() const { return id_; }
  double resolution() const { return resolution_; }
  const Plane& plane() const { return plane_; }
  const Eigen::Isometry3d& pose() const { return pose_; }
  std::size_t size() const { return size_; }
  std::vector<SurfaceId>& parents() { return parents_; }
  const std::vector<SurfaceId>& parents() const { return parents_; }

  double distance(const Eigen::Vector3f& p) const { return plane_.signed_distance(p.cast<double>()); }

  void add(const Inlier& inlier);
  /// `position` must be the one it was added with. False if it is not an inlier.
  bool remove(geometry::VoxelKey key, const Eigen::Vector3f& position);

  // The cell of a point in the plane; the hash frame follows the plane coarsely (see rehash).
  geometry::PlaneCell cell_of(const Eigen::Vector3f& p) const;
  bool occupied(geometry::PlaneCell cell) const { return bits_.occupied(cell); }
  /// Raster equivalent of "inside the polygon": the cell has an inlier, or five of its neighbours do.
  bool covers(geometry::PlaneCell cell) const;
  /// All eight neighbours have inliers.
  bool surrounded(geometry::PlaneCell cell) const;
  /// The nearest cell with an inlier, at most `reach` cells off.
  std::optional<geometry::PlaneCell> nearest(geometry::PlaneCell cell, int reach) const;
  /// The place at (u, v) in cells, map frame, on the hash frame's plane, which is within one degree of the
  /// plane.
  Eigen::Vector3d place_of(const Eigen::Vector2d& uv) const;
  Eigen::Vector3d centre_of(geometry::PlaneCell cell) const { return place_of({cell.u + 0.5, cell.v + 0.5}); }

  /// Calls visit(CellBits::Cells) with the occupied cells of each tile, in no particular order.
  template <class Visit>
  void for_each_tile(Visit&& visit) const {
    bits_.for_each_tile(std::forward<Visit>(visit));
  }
  /// From cells to (u, v) in a surface frame, along the frame's normal: of a place on the hash frame's plane.
  Eigen::Affine2d T_frame_cells(const Eigen::Isometry3d& T_frame_map) const;

  /// Inliers in key order; O(n log n).
  std::vector<Inlier> sorted_inliers() const;
  template <class Visit>
  void for_each_inlier(Visit&& visit) const {  ///< in no particular order
    inliers_.for_each(std::forward<Visit>(visit));
  }

  /// Adds the mean of a scan's points in an inlier's voxel. Older readings fade once there are more than a
  /// hundred for each inlier, or when inliers are removed.
  void observe(const Eigen::Vector3f& position, double weight);
  const Evidence& evidence() const { return evidence_; }
  void forget_evidence() { evidence_ = {}; }
  /// Adds the evidence of a surface that merges into this one.
  void take_evidence(const SurfaceModel& other);

  /// Moments over all inliers, weighted by 1/measured_sigma² relative to the nearest class's σ, with the
  /// evidence, about reference(); over the inliers alone, unweighted, if `noise` is null.
  geometry::Moments moments(const sensing::NoiseModel* noise) const;
  /// The plane that fits all readings best: total least squares over moments(&noise), facing as the current
  /// one. derive_covariance() gives its covariance.
  Plane estimate(const sensing::NoiseModel& noise) const;
  /// Over the inliers of one range class, unweighted, about reference().
  const geometry::Moments& moments_of_class(unsigned range_class) const { return moments_[range_class]; }
  /// Number of readings in moments(noise).
  double readings() const { return static_cast<double>(size_) + evidence_.readings; }
  const Eigen::Vector3d& reference() const { return reference_; }
  double rms() const;

  /// Sets the plane; the pose follows by the smallest rotation from the old normal to the new one, with its
  /// origin projected onto the plane.
  void set_plane(const Plane& plane);
  /// Rebuilds the hash in the current pose if the normal differs from the hash frame's by over 1°.
  void rehash_if_tilted();

  bool polygons_stale() const { return polygons_stale_; }
  /// Updates polygons() to inliers and pose: the alpha shape of the inliers' outline points, with `noise`
  /// also of their boundary points, and with `others` also of the Intersections with these, projected onto
  /// the plane along the hash frame's normal. Cost follows the inliers added and removed near the boundary,
  /// plus the length of the rings, and of the boundary where others are near, and some 0.2 µs for each 64
  /// occupied cells. All sites are inserted anew after a load, a rehash, or a change of the noise by 1 mm.
  ///
  /// 1. The result does not depend on earlier calls.
  /// 2. A vertex lies within sin 1° of its inlier's distance from the plane beside its projection, its end
  ///    point or its intersection with another surface, and within half an Outline::quantum of a cell; sides
  ///    are at most `max_hole_size` long.
  void derive(double max_hole_size, const sensing::NoiseModel* noise = nullptr,
              const SurfaceStore* others = nullptr);
  /// The parts of derive() but polygons_with(), which may be left to a reader; there are no polygons() then.
  /// The first changes the part of the raster that other surfaces read, the second reads that of `others` and
  /// changes no shared data: after the first has run for all, threads may run the second in parallel.
  void update_raster(double max_hole_size, const sensing::NoiseModel* noise);
  OutlineChange take_outline_change(double max_hole_size, const SurfaceStore* others);
  /// The end of the readings in an inlier's voxel toward the boundary of the surface at its cell: the inlier
  /// is the mean of readings that begin at the voxel's inner side, so they extend as far beyond it. Reduced
  /// by `edge_bleed` m, because noise carries readings over an edge. Inside the voxel, map frame; empty if it
  /// coincides with the inlier, its cell is not at a boundary, or the point is a voxel's centre for lack of
  /// readings.
  std::optional<Eigen::Vector3f> boundary_point(const Inlier& inlier, double edge_bleed) const;
  /// A point in the hash frame, in cells, as used by the outline.
  Eigen::Vector2d outline_point(const Eigen::Vector3f& p) const;
  /// α for outline points: `max_hole_size` in cells, less the stretch by tilting.
  double outline_alpha(double max_hole_size) const;
  /// Outline points at intersections with others, as of the last derive(); none after a load.
  std::vector<Eigen::Vector2d> intersection_sites() const;
  /// Outline points to (u, v) in the surface's frame, along the hash frame's normal.
  Eigen::Affine2d T_surface_outline() const;
  /// Assumed extent of readings beyond an edge, m, by range class, as of the last derive(); d, beyond the
  /// range of boundary points, before and without noise.
  using EdgeBleed = std::array<double, sensing::NoiseModel::classes>;
  const EdgeBleed& edge_bleed() const { return edge_bleed_; }
  /// Number of sites of the outline: all inliers, except those deep inside (all cells within two of theirs
  /// occupied), which are replaced by a lattice of cells' centres, boundary points, and intersections.
  std::size_t outline_sites() const { return outline_ ? outline_->outline.sites() : 0; }
  /// As of derive() or a load; none after take_outline_change().
  const std::vector<Polygon>& polygons() const { return polygons_; }

  /// Updates the covariance to moments(&noise) and pose, see Surface::covariance. O(1).
  void derive_covariance(const sensing::NoiseModel& noise);
  /// As last derived; zero before.
  const Eigen::Matrix3d& covariance() const { return covariance_; }

  /// The immutable form for readers.
  SurfacePtr publish(std::uint64_t revision) const;

  // State for map files that add() and set_plane() cannot restore.
  struct State {
    SurfaceId id = 0;
    Plane plane;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity(), hash_frame = Eigen::Isometry3d::Identity();
    Eigen::Vector3d reference = Eigen::Vector3d::Zero();
    std::array<geometry::Moments, sensing::NoiseModel::classes> moments;
    Evidence evidence;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    std::vector<Inlier> inliers;  ///< key order
    std::vector<Polygon> polygons;
    std::vector<SurfaceId> parents;
    bool polygons_stale = false;
    std::uint64_t born = 0;
    std::uint64_t revision = 0;
    std::uint64_t checked_size = 0;
  };
  /// `published`: the map's complete snapshot, which has the polygons; null: they are polygons().
  State state(const Snapshot* published = nullptr) const;
  /// The same without inliers and polygons, O(1): for callers that have those already.
  State head() const;
  SurfaceModel(const State& state, double resolution, memory::PageFile* file = nullptr);

  /// Records that the whole surface was segmented.
  void set_checked() { checked_size = size_; }
  /// Whether it has doubled, or lost a third, since the whole surface was segmented. Temporary changes, as in
  /// the tails of the noise, do not count.
  bool size_has_changed() const {
    return 2 * (std::max(size_, checked_size) - std::min(size_, checked_size)) >= size_;
  }

  std::uint64_t born = 0;          ///< map revision in which it was first published
  std::uint64_t revision = 0;      ///< map revision of the last published change
  std::uint64_t checked_size = 0;  ///< inliers when the whole surface was last segmented
  std::uint64_t kept_in = 0;       ///< used by SurfaceStore

 private:
  /// Largest angle of the hash frame to the plane. It shifts an outline's vertex by 1/57 of its inlier's
  /// distance from the plane, whatever the surface's extent: far less than a voxel. Rehashing costs O(n).
  static constexpr double cos_largest_tilt = 0.99984769515639;  // 1°

  void fade(double share);
  void insert(const Inlier& inlier);
  void set_hash_frame(const Eigen::Isometry3d& frame);
  std::optional<Eigen::Vector3d> outward(geometry::PlaneCell cell) const;
  /// A site of the outline at an intersection with others, extended from an inlier of a cell.
  struct IntersectionSite {
    std::uint8_t bit;  // of the cell in its tile
    Eigen::Vector2d at;
    bool operator==(const IntersectionSite&) const = default;
  };
  using SitesOfTile = std::vector<IntersectionSite>;
  using IntersectionSites = tsl::robin_map<std::uint64_t, SitesOfTile, geometry::PackedKeyHash>;
  IntersectionSites find_intersections(const SurfaceStore& others, double gap) const;
  static void add_cells_of(const IntersectionSites& a, const IntersectionSites& b,
                           std::vector<geometry::CellBits::Cells>& cells);
  void add_sites_of(geometry::PlaneCell cell, int spacing, std::vector<Eigen::Vector2d>& sites) const;

  SurfaceId id_;
  double resolution_;
  memory::PageFile* file_;
  Plane plane_;
  Eigen::Isometry3d pose_;
  Eigen::Isometry3d hash_frame_;
  Eigen::Matrix<float, 2, 3> hash_axes_;  // rows: u and v axis / d
  Eigen::Vector3d hash_origin_;
  Eigen::Vector3d reference_;
  std::array<geometry::Moments, sensing::NoiseModel::classes> moments_;
  Evidence evidence_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  InlierTiles inliers_{file_};
  geometry::CellBits bits_{file_};
  std::vector<geometry::CellBits::Cells> changed_;  // since the last take_outline_change()
  std::shared_ptr<SharedOutline> outline_;          // null before the first update_raster()
  IntersectionSites intersections_;                 // by tile, as in the outline
  EdgeBleed edge_bleed_;
  std::size_t size_ = 0;
  std::vector<SurfaceId> parents_;
  bool polygons_stale_ = true;
  std::vector<Polygon> polygons_;
};

/// Distinct by construction: the hue advances by the golden ratio with the id.
std::array<float, 3> color_of(SurfaceId id);

}  // namespace octosurf::surfaces
