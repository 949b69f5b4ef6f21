#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// The place on a surface nearest to a point.
struct Nearest {
  SurfaceId id = 0;                                 ///< of the surface
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< map frame, on the surface's `polygons`
  double distance = 0;                              ///< m
};

/// Restricts a query to surfaces whose slope_rad() to `up` is at most `max_slope_rad`.
struct SlopeLimit {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, any length; see up_of(map)
  double max_slope_rad = std::numbers::pi;        ///< π/2 excludes overhanging surfaces such as ceilings
};

/// A convex part of space: all points with normal·x ≤ offset for each of its planes. Map frame.
struct ConvexSpace {
  std::vector<Plane> planes;  ///< normals outward

  /// The box, its faces included.
  static ConvexSpace box(const Eigen::AlignedBox3d& box);
};

/// Intersection of a ray and a surface.
struct RayHit {
  SurfaceId id = 0;                                 ///< the surface it meets
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< map frame, on the surface's `polygons`
  double distance = 0;                              ///< m
  bool front = true;                                ///< hit on the side the surface was seen from
};

/// Spatial index of a snapshot's surfaces for frequent queries. Immutable and thread-safe.
///
/// An index for the next snapshot reuses unchanged parts of this one: 20 µs for some hundred surfaces plus
/// 0.3 µs for each vertex of changed ones; after each scan of a kitchen 0.2 ms, a four-hundredth of the
/// insertion. It is separate from the snapshot so that only readers with queries pay for it, in their own
/// threads. Readers may share one. On equal distance the lower id wins. Everything in
/// the map frame. Points that are not finite, or an invalid limit, throw Error(usage).
class SurfaceIndex {
 public:
  /// `previous`: an index of an earlier snapshot to reuse; it is not modified.
  explicit SurfaceIndex(std::shared_ptr<const Snapshot> snapshot, const SurfaceIndex* previous = nullptr);
  SurfaceIndex(SurfaceIndex&&) noexcept;
  SurfaceIndex& operator=(SurfaceIndex&&) noexcept;
  ~SurfaceIndex();

  const Snapshot& snapshot() const;  ///< the indexed snapshot

  /// Surfaces with any point in the space, its border included; ascending id. Some µs, and O(log n) per
  /// surface near it.
  std::vector<SurfaceId> in(const ConvexSpace& space) const;
  /// Likewise within `radius` m of `center`.
  std::vector<SurfaceId> in_sphere(const Eigen::Vector3d& center, double radius) const;

  /// The nearest place on a surface that the limit allows, at most `within` m away. Some µs.
  std::optional<Nearest> nearest(const Eigen::Vector3d& point, const SlopeLimit& limit = {},
                                 double within = std::numeric_limits<double>::infinity()) const;
  /// The first surface straight below a point (against `limit.up`) or at it: the one that a lowered foot
  /// touches. Surfaces parallel to `up` are never met. Some µs.
  std::optional<Nearest> below(const Eigen::Vector3d& point, const SlopeLimit& limit = {}) const;

  /// The first surface along a ray, from either side, at most `within` m away. Surfaces parallel to the ray
  /// are not hit. Throws Error(usage) for a direction that is zero or not finite.
  std::optional<RayHit> first_on_ray(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                     double within = std::numeric_limits<double>::infinity()) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf
