#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <octosurf/cylinder.hpp>
#include <octosurf/departures.hpp>
#include <octosurf/ids.hpp>
#include <octosurf/occupancy.hpp>

namespace octosurf {

/// n·x = offset with |n| = 1, n toward the side the surface was seen from. Map frame, metres.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector
  double offset = 0;                                  ///< m, of the plane from the origin along the normal

  /// m; positive on the side the normal points to.
  double signed_distance(const Eigen::Vector3d& point) const { return normal.dot(point) - offset; }
};

using Ring2 = std::vector<Eigen::Vector2d>;  ///< not closed: the last vertex differs from the first

/// In the surface's frame (u, v): outer ring counter-clockwise seen from the normal's tip, holes
/// clockwise, in it. Rings are simple, polygons apart; two rings may share single vertices.
struct Polygon {
  Ring2 outer;               ///< counter-clockwise
  std::vector<Ring2> holes;  ///< clockwise
};

/// Closed triangle mesh, map frame, faces counter-clockwise seen from outside.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;                ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< three indices into `vertices` each
};

/// One contact surface as a planner sees it. Immutable once published in a Snapshot.
///
/// 1. Every inlier's projection lies inside `polygons` or on their rings, unless every triangle at it
///    in the Delaunay triangulation has a side over h.
/// 2. `boundary` are the rings' vertices; neighbours on a ring are never more than h apart.
/// 3. Polygons do not overlap; islands in holes are polygons of their own.
struct Surface {
  SurfaceId id = 0;              ///< for good: never reused
  double resolution = 0;         ///< d of the map, m
  std::array<float, 3> color{};  ///< RGB in [0, 1], distinct by construction
  Plane plane;                   ///< fitted to the inliers' readings
  /// Surface frame to map frame: z = plane.normal, origin on the plane. Moved as little as
  /// possible when the plane is refitted.
  Eigen::Isometry3d T_map_surface = Eigen::Isometry3d::Identity();
  /// Alpha shape, α = h, of the inliers and of where the readings in the outermost voxels end; (u, v).
  std::vector<Polygon> polygons;
  std::vector<Eigen::Vector3d> boundary;  ///< map frame, on the plane
  double area_m2 = 0;                     ///< of `polygons`
  std::size_t inliers = 0;                ///< voxels
  double rms_m = 0;                       ///< of the inliers' distances to the plane
  /// How sure the plane is, in the surface's frame at its origin: the true one is taken to be
  /// off = c + a·u + b·v there, and this is the covariance of (a [rad], b [rad], c [m]) about zero, out of
  /// what the readings scatter about the plane. Symmetric positive definite. It does not know the poses'
  /// errors, nor what readings have in common (a sensor's bias): where those count, the plane is less sure.
  /// Simulated tables of 0.6 by 0.4 m erred by 0.7 to 1.5 times as much, by up to 2 where the noise reaches
  /// s. Rays keep the voxels before a plane free, those behind it not, so that a large one comes to lie too
  /// deep the more often it is seen. How far repeated observations say otherwise is in the offset's variance:
  /// after twelve scans tables of 1.2 by 0.8 m erred by 1.2 times as much as said (2 mm of noise; 0.09 mm).
  /// Where noise reaches s, they are taken along: one of 1.8 by 1.2 m lay 0.95 mm off (8 mm of noise), of
  /// which little is said.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::uint64_t born = 0;          ///< map revision in which it appeared; 0: before maps noted that
  std::uint64_t revision = 0;      ///< map revision of the last change
  std::vector<SurfaceId> parents;  ///< ids merged into this one, or the one it was split from

  /// Of the normal's tilt in the direction in which it is least sure, rad.
  double normal_std_rad() const;
  /// Of the plane's height at the frame's origin, m.
  double offset_std_m() const { return std::sqrt(covariance(2, 2)); }

  /// A point of the surface's frame, in the map's.
  Eigen::Vector3d to_map(const Eigen::Vector2d& uv) const {
    return T_map_surface * Eigen::Vector3d(uv.x(), uv.y(), 0);
  }
};

/// Keeps a surface of a snapshot alive.
using SurfacePtr = std::shared_ptr<const Surface>;

/// A consistent view of all surfaces at one revision; never changes, cheap to copy and to keep.
struct Snapshot {
  std::uint64_t revision = 0;            ///< of the map when it was taken
  double resolution = 0;                 ///< d of the map, m
  std::vector<SurfacePtr> surfaces;      ///< ascending id
  std::vector<CylinderPtr> cylinders{};  ///< ascending id
  DepartureLog departures{};             ///< of all surfaces and cylinders that are no more
  OccupancyView octree{};  ///< of the same scan; knows nothing unless the Mapper is told to share_octree()

  /// nullptr if there is none; O(log n).
  const Surface* find(SurfaceId id) const;
  /// Likewise among the cylinders.
  const Cylinder* find_cylinder(CylinderId id) const;
  /// Surfaces changed after `revision`; O(n).
  std::vector<SurfacePtr> changed_since(std::uint64_t revision) const;
};

/// The polygons without near-collinear vertices: the outline moves by at most d/2, rings stay simple and
/// apart (Dyken et al. 2009). All if the surface's resolution is 0. Throws Error(data) unless they are
/// Polygons. O(n log n) in vertices, about 4 µs each: taken when asked for, because mapping does not need it.
std::vector<Polygon> simplified(const Surface& surface);

/// The polygon extruded by `thickness` m against the normal (paper IV-B): closed, every edge in
/// exactly two triangles. Rings that share a vertex get a copy each. Cost O(n log n) in vertices.
Mesh extrude(const Surface& surface, double thickness);

}  // namespace octosurf
