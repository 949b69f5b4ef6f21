#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <octosurf/planning.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// A convex part of space: all points with normal·x ≤ offset for each of its planes. Map frame.
struct ConvexSpace {
  std::vector<Plane> planes;  ///< normals outward

  /// The box, its faces included.
  static ConvexSpace box(const Eigen::AlignedBox3d& box);
  /// What a camera sees between two distances along its z axis: `T_map_camera` with x right, y down, z
  /// forward, the tangents of the half angles to the right and down.
  static ConvexSpace frustum(const Eigen::Isometry3d& T_map_camera, double tan_right, double tan_down,
                             double near, double far);
};

/// Where a ray meets a surface.
struct RayHit {
  SurfaceId id = 0;                                 ///< the surface it meets
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< map frame, on the surface's `polygons`
  double distance = 0;                              ///< m
  bool front = true;                                ///< from the side the surface was seen from
};

/// A pose laid on a surface.
struct SnappedPose {
  SurfaceId id = 0;                                              ///< the surface it lies on
  Eigen::Isometry3d T_map_pose = Eigen::Isometry3d::Identity();  ///< origin on the plane, z its normal
  double moved_m = 0;                                            ///< how far its origin moved
  double turned_rad = 0;                                         ///< and by how much it turned
};

/// A snapshot's surfaces, ordered by place for questions that are asked often. Immutable: every thread may
/// ask.
///
/// Another one for the next snapshot takes over from this what has not changed: with some hundred surfaces
/// that takes 20 µs, and 0.3 µs for each vertex of those that have; after each scan of a kitchen 0.2 ms, a
/// four-hundredth of the time that the scan takes to insert (`./dev bench queries`). It is not a part of the
/// snapshot because only who asks is to pay for it: a reader that takes every tenth snapshot makes every
/// tenth index, and its own thread does, not the mapper's. Readers may share one. Polygons are as
/// planning.hpp's nearest() and below() take them, which look at every surface and give the same answers. Of
/// surfaces that are as near, the lower id wins. Everything in the map frame. Points that are not finite
/// throw Error(usage).
class SurfaceIndex {
 public:
  /// `previous`: of an earlier snapshot, to take over from; only read.
  explicit SurfaceIndex(std::shared_ptr<const Snapshot> snapshot, const SurfaceIndex* previous = nullptr);
  SurfaceIndex(SurfaceIndex&&) noexcept;
  SurfaceIndex& operator=(SurfaceIndex&&) noexcept;
  ~SurfaceIndex();

  const Snapshot& snapshot() const;  ///< the snapshot it was made of

  /// Surfaces of which any point lies in the space, its border included; ascending id. Some µs, and O(log n)
  /// per surface near it.
  std::vector<SurfaceId> in(const ConvexSpace& space) const;
  /// Likewise within `radius` m of `center`.
  std::vector<SurfaceId> in_sphere(const Eigen::Vector3d& center, double radius) const;

  /// As planning.hpp has them; nearest() not beyond `within` m. Some µs.
  std::optional<Nearest> nearest(const Eigen::Vector3d& point, const SlopeLimit& limit = {},
                                 double within = std::numeric_limits<double>::infinity()) const;
  /// As planning.hpp's below(). Some µs.
  std::optional<Nearest> below(const Eigen::Vector3d& point, const SlopeLimit& limit = {}) const;

  /// The first surface along a ray, from either side, at most `within` m away. Surfaces that the ray runs in
  /// are not met. Throws Error(usage) for a direction that is zero or not finite.
  std::optional<RayHit> first_on_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                     double within = std::numeric_limits<double>::infinity()) const;

  /// The pose moved to the nearest surface within `within` m that the limit allows, its z axis turned to the
  /// normal by the shortest way: what a foot or a hand does that is set down there.
  std::optional<SnappedPose> snap(const Eigen::Isometry3d& T_map_pose, const SlopeLimit& limit = {},
                                  double within = std::numeric_limits<double>::infinity()) const;

  /// The surface that the voxel which holds `point` belongs to, out of the snapshot's octree; 0: none, or the
  /// snapshot has no octree.
  SurfaceId surface_of_voxel(const Eigen::Vector3d& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
