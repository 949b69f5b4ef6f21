#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <octosurf/cylinder.hpp>
#include <octosurf/ids.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/removals.hpp>

namespace octosurf {

/// n·x = offset with |n| = 1, n toward the side the surface was seen from. Map frame, metres.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector
  double offset = 0;                                  ///< m, of the plane from the origin along the normal

  /// m; positive on the side the normal points to.
  double signed_distance(const Eigen::Vector3d& point) const { return normal.dot(point) - offset; }
};

using Ring2 = std::vector<Eigen::Vector2d>;  ///< not closed: the last vertex differs from the first

/// In the surface's frame (u, v): outer ring counter-clockwise seen from the normal's tip, holes clockwise
/// inside it. Rings are simple, polygons disjoint; two rings may share single vertices.
struct Polygon {
  Ring2 outer;               ///< counter-clockwise
  std::vector<Ring2> holes;  ///< clockwise
};

/// Closed triangle mesh, map frame, faces counter-clockwise seen from outside.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;                ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< three indices into `vertices` each
};

/// One contact surface. Immutable once published in a Snapshot.
///
/// 1. Every inlier's projection lies inside `polygons` or on their rings, unless every triangle at it in the
///    Delaunay triangulation has a side over h.
/// 2. `boundary` are the rings' vertices; neighbours on a ring are at most h apart.
/// 3. Polygons do not overlap; islands in holes are separate polygons.
struct Surface {
  SurfaceId id = 0;              ///< permanent, never reused
  double resolution = 0;         ///< d of the map, m
  std::array<float, 3> color{};  ///< RGB in [0, 1], distinct by construction
  Plane plane;                   ///< fitted to the inliers' readings
  /// Surface frame to map frame: z = plane.normal, origin on the plane. A refit of the plane moves it as
  /// little as possible.
  Eigen::Isometry3d T_map_surface = Eigen::Isometry3d::Identity();
  /// Alpha shape, α = h, of the inliers and of the end points of readings in the outermost voxels; (u, v).
  std::vector<Polygon> polygons;
  std::vector<Eigen::Vector3d> boundary;  ///< map frame, on the plane
  double area_m2 = 0;                     ///< of `polygons`
  std::size_t inliers = 0;                ///< voxels
  double rms_m = 0;                       ///< of the inliers' distances to the plane
  /// Uncertainty of the plane, in the surface's frame at its origin: the true plane deviates by c + a·u +
  /// b·v, and this is the covariance of (a [rad], b [rad], c [m]) with mean zero, from the readings' scatter
  /// about the plane. Symmetric positive definite. Errors shared by readings (poses, a sensor's bias) are not
  /// included; they make the plane less certain. Simulated tables of 0.6 by 0.4 m erred by 0.7 to 1.5 times
  /// the standard deviation, by up to 2 where the noise reaches s. Rays keep the voxels before a plane free,
  /// not those behind it, so a large plane drifts backward with the number of observations. The offset's
  /// variance includes the disagreement of repeated observations: after twelve scans tables of 1.2 by 0.8 m
  /// erred by 1.2 times as much (2 mm of noise; 0.09 mm). Where noise reaches s, repeated observations share
  /// the error: a table of 1.8 by 1.2 m lay 0.95 mm off (8 mm of noise), of which the variance covers little.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint64_t born = 0;          ///< map revision in which it appeared
  std::uint64_t revision = 0;      ///< map revision of the last change
  std::vector<SurfaceId> parents;  ///< merged into this one, or what it was split from; 1,000 at most

  /// Standard deviation of the normal's tilt in its least certain direction, rad.
  double normal_std_rad() const;
  /// Standard deviation of the plane's height at the frame's origin, m.
  double offset_std_m() const { return std::sqrt(covariance(2, 2)); }

  /// Transforms a point from the surface's frame to the map's.
  Eigen::Vector3d to_map(const Eigen::Vector2d& uv) const {
    return T_map_surface * Eigen::Vector3d(uv.x(), uv.y(), 0);
  }
};

/// Keeps a surface of a snapshot alive.
using SurfacePtr = std::shared_ptr<const Surface>;

/// A consistent, immutable view of all surfaces at one revision; cheap to copy and keep.
struct Snapshot {
  std::uint64_t revision = 0;            ///< of the map when it was taken
  double resolution = 0;                 ///< d of the map, m
  std::vector<SurfacePtr> surfaces;      ///< ascending id
  std::vector<CylinderPtr> cylinders{};  ///< ascending id
  RemovalLog removals{};                 ///< of all removed surfaces and cylinders
  OccupancyView octree{};                ///< of the same scan; empty without Mapper::share_octree()

  /// nullptr if there is none; O(log n).
  const Surface* find(SurfaceId id) const;
  /// Likewise among the cylinders.
  const Cylinder* find_cylinder(CylinderId id) const;
  /// Surfaces changed after `revision`; O(n).
  std::vector<SurfacePtr> changed_since(std::uint64_t revision) const;
};

/// The polygons without near-collinear vertices: the outline moves by at most d/2, rings stay simple and
/// disjoint (Dyken et al. 2009). All vertices if the surface's resolution is 0. Throws Error(data) for
/// invalid Polygons. O(n log n) in vertices, about 4 µs each; computed on request, because mapping does not
/// need it.
std::vector<Polygon> simplified(const Surface& surface);

/// The polygon extruded by `thickness` m against the normal (paper IV-B): closed, every edge in exactly two
/// triangles. A vertex shared by rings is duplicated. Cost O(n log n) in vertices.
Mesh extrude(const Surface& surface, double thickness);

}  // namespace octosurf
