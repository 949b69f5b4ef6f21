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

/// The working form of a surface: its inliers in a 2-D hash over its own plane, running moments of
/// them by distance class, plane, stable pose, and what was derived from them last.
///
/// 1. Every inlier stands in exactly the cell its position falls into (in `hash_frame`).
/// 2. Moments are the sums over exactly the inliers (up to rounding).
/// 3. `polygons_stale()` is false only if no inlier came or went where the boundary could move.
class SurfaceModel {
 public:
  /// Repeated observations of the inliers' voxels, beside the point that each voxel keeps. They make the
  /// plane exact, because a voxel that noise reached only once weighs little in these sums.
  struct Evidence {
    geometry::Moments moments;  ///< about reference(), weights as of an inlier of the nearest class
    double readings = 0;        ///< scans' voxels that were added
  };

  SurfaceModel(SurfaceId id, const Plane& plane, const Eigen::Vector3d& origin, double resolution);

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

  // Where a point falls in the plane; the hash frame follows the plane coarsely (see rehash).
  geometry::PlaneCell cell_of(const Eigen::Vector3f& p) const;
  bool occupied(geometry::PlaneCell cell) const { return bits_.occupied(cell); }
  /// Raster twin of "inside the polygon": the cell holds an inlier, or five of its neighbours do.
  bool covers(geometry::PlaneCell cell) const;
  /// All eight neighbours hold inliers.
  bool surrounded(geometry::PlaneCell cell) const;
  /// The nearest cell that holds an inlier, at most `reach` cells off.
  std::optional<geometry::PlaneCell> nearest(geometry::PlaneCell cell, int reach) const;
  /// A cell's centre, map frame, on the hash frame's plane: within a degree's tilt of the plane.
  Eigen::Vector3d centre_of(geometry::PlaneCell cell) const;

  /// Inliers in key order; O(n log n).
  std::vector<Inlier> sorted_inliers() const;
  template <class Visit>
  void for_each_inlier(Visit&& visit) const {  ///< in no particular order
    inliers_.for_each(std::forward<Visit>(visit));
  }

  /// Adds the mean of a scan's points in an inlier's voxel. Older readings fade once there are more
  /// than a hundred for each inlier, or inliers go.
  void observe(const Eigen::Vector3f& position, double weight);
  const Evidence& evidence() const { return evidence_; }
  void forget_evidence() { evidence_ = {}; }
  /// Another surface's, which merges into this one.
  void take_evidence(const SurfaceModel& other);

  /// Moments over all inliers, weighted by 1/measured_sigma² relative to the nearest class's σ, with the
  /// evidence, about reference(); over the inliers alone, unweighted, if `noise` is null.
  geometry::Moments moments(const sensing::NoiseModel* noise) const;
  /// Over the inliers of one class of distance, unweighted, about reference().
  const geometry::Moments& moments_of_class(unsigned range_class) const { return moments_[range_class]; }
  /// How many readings are in moments(noise).
  double readings() const { return static_cast<double>(size_) + evidence_.readings; }
  const Eigen::Vector3d& reference() const { return reference_; }
  double rms() const;

  /// Moves the plane; the pose follows by the smallest rotation that takes the old normal to the
  /// new one, its origin staying above the same spot.
  void set_plane(const Plane& plane);
  /// Rebuilds the hash in the present pose once the normal has left the hash frame's by over 1°.
  void rehash_if_tilted();

  bool polygons_stale() const { return polygons_stale_; }
  /// Brings the polygons up to date with inliers and pose: the alpha shape of the inliers' outline
  /// points, with `noise` of their rim points, and with `others` of the points where it meets these
  /// (Meetings), along the hash frame's normal on the plane. Cost follows the inliers that came and went near
  /// the rim, plus the length of the rings, and of the rim where others are near, and some 0.2 µs for each 64
  /// cells that hold some; all sites are inserted once after a load or a rehash, and where the noise has
  /// become another by a millimetre.
  ///
  /// 1. They do not depend on what was derived before.
  /// 2. A vertex lies within sin 1° of its inlier's distance from the plane beside its projection, its rim
  ///    point or where it meets another surface, and within half an Outline::quantum of a cell; sides are at
  ///    most `max_hole_size` long.
  void derive(double max_hole_size, const sensing::NoiseModel* noise = nullptr,
              const SurfaceStore* others = nullptr);
  /// The two halves of derive(). The first changes what others read of this surface's raster, the second
  /// reads that of `others` and changes nothing that they read: once all have done the first, threads may
  /// share the second.
  void update_raster(double max_hole_size, const sensing::NoiseModel* noise);
  void derive_outline(double max_hole_size, const SurfaceStore* others);
  /// Where the readings in an inlier's voxel end, toward the rim of the surface that its cell lies at: the
  /// inlier is the mean of readings that begin at the voxel's inner side, so they go on as far beyond it.
  /// Less by `overreach` m, because noise carries readings over an edge. Inside the voxel, map frame;
  /// nothing if the inlier itself says as much, its cell lies at no rim, or it is a voxel's centre for want
  /// of readings.
  std::optional<Eigen::Vector3f> rim_point(const Inlier& inlier, double overreach) const;
  /// A point in the hash frame, in cells, as the outline takes it.
  Eigen::Vector2d outline_point(const Eigen::Vector3f& p) const;
  /// α for outline points: `max_hole_size` in cells, less what tilting may stretch.
  double outline_alpha(double max_hole_size) const;
  /// Outline points where it meets others, as of the last derive(); none after a load.
  std::vector<Eigen::Vector2d> meeting_sites() const;
  /// Outline points to (u, v) in the surface's frame, along the hash frame's normal.
  Eigen::Affine2d T_surface_outline() const;
  /// How far readings are taken to lie beyond an edge, m, by range class, as of the last derive(); d, which
  /// is out of rim points' reach, before and without noise.
  using Overreach = std::array<double, sensing::NoiseModel::classes>;
  const Overreach& overreach() const { return overreach_; }
  /// How many sites the outline keeps: all inliers, except those deep inside (all cells within two of
  /// theirs occupied), for which a lattice of cells' centres stands in, rim points, and meetings.
  std::size_t outline_sites() const { return outline_ ? outline_->sites() : 0; }
  const std::vector<Polygon>& polygons() const { return polygons_; }

  /// Brings the covariance up to date with moments(&noise) and pose, see Surface::covariance. O(1).
  void derive_covariance(const sensing::NoiseModel& noise);
  /// As last derived; zero before.
  const Eigen::Matrix3d& covariance() const { return covariance_; }

  /// The immutable form for readers.
  SurfacePtr publish(std::uint64_t revision) const;

  // State for map files: what add() and set_plane() cannot restore.
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
  State state() const;
  /// The same without inliers and polygons, O(1): for whoever has those elsewhere.
  State head() const;
  SurfaceModel(const State& state, double resolution);

  /// It was looked at as a whole.
  void set_checked() { checked_size = size_; }
  /// It has doubled, or lost a third, since it was looked at as a whole. What comes and goes again, as in the
  /// tails of the noise, does not count.
  bool size_has_changed() const {
    return 2 * (std::max(size_, checked_size) - std::min(size_, checked_size)) >= size_;
  }

  std::uint64_t born = 0;          ///< map revision in which it was first published
  std::uint64_t revision = 0;      ///< map revision of the last published change
  std::uint64_t checked_size = 0;  ///< inliers when it was last looked at as a whole
  std::uint64_t kept_in = 0;       ///< the SurfaceStore's

 private:
  /// Of the hash frame against the plane. It shifts an outline's vertex by 1/57 of its inlier's distance
  /// from the plane, whatever the surface's extent: far less than a voxel. Rehashing costs O(n).
  static constexpr double cos_largest_tilt = 0.99984769515639;  // 1°

  void fade(double share);
  void insert(const Inlier& inlier);
  void set_hash_frame(const Eigen::Isometry3d& frame);
  std::optional<Eigen::Vector3d> outward(geometry::PlaneCell cell) const;
  /// A site of the outline where the surface meets others, going on from an inlier of a cell.
  struct MeetingSite {
    std::uint8_t bit;  // the cell's in its tile
    Eigen::Vector2d at;
    bool operator==(const MeetingSite&) const = default;
  };
  using MeetingSites = tsl::robin_map<std::uint64_t, std::vector<MeetingSite>, geometry::PackedKeyHash>;
  MeetingSites find_meetings(const SurfaceStore& others, double gap) const;
  static void add_cells_of(const MeetingSites& a, const MeetingSites& b,
                           std::vector<geometry::CellBits::Cells>& cells);
  void sites_of(geometry::PlaneCell cell, int spacing, std::vector<Eigen::Vector2d>& sites) const;

  SurfaceId id_;
  double resolution_;
  Plane plane_;
  Eigen::Isometry3d pose_;
  Eigen::Isometry3d hash_frame_;
  Eigen::Matrix<float, 2, 3> hash_axes_;  // rows: u and v axis / d
  Eigen::Vector3d hash_origin_;
  Eigen::Vector3d reference_;
  std::array<geometry::Moments, sensing::NoiseModel::classes> moments_;
  Evidence evidence_;
  Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Zero();
  InlierTiles inliers_;
  geometry::CellBits bits_;
  std::vector<geometry::CellBits::Cells> changed_;  // of it, since the last derive_outline()
  std::optional<geometry::Outline> outline_;        // none before the first derive()
  MeetingSites meetings_;                           // by tile, as the outline has them
  Overreach overreach_;
  std::size_t size_ = 0;
  std::vector<SurfaceId> parents_;
  bool polygons_stale_ = true;
  std::vector<Polygon> polygons_;
};

/// Distinct by construction: the hue steps by the golden ratio from id to id.
std::array<float, 3> color_of(SurfaceId id);

}  // namespace octosurf::surfaces
