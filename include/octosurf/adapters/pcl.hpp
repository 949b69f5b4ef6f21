#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <pcl/ModelCoefficients.h>
#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/planar_region.h>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

// Conversions from and to PCL's types. Needs PCL's headers and pcl_common besides octosurf::octosurf. PCL
// uses 32-bit floats: results are rounded to them.

namespace octosurf {

/// Converts a cloud with its sensor's pose (`sensor_origin_`, `sensor_orientation_`), its time
/// (`header.stamp`, µs) and `header.frame_id` as name. The sensor's kind is its frame's (sensor_of_frame()).
/// Points exactly at the origin are no readings: drivers write them for missing returns. Throws Error(data)
/// if the orientation is not a rotation.
template <class Point>
Scan to_scan(const pcl::PointCloud<Point>& cloud) {
  const Eigen::Quaterniond orientation = cloud.sensor_orientation_.template cast<double>();
  if (!(std::abs(orientation.norm() - 1) <= 1e-3))
    throw Error(Error::Kind::data, "sensor_orientation_", "is not a unit quaternion",
                "give the sensor's pose");
  Scan scan;
  scan.T_map_sensor.linear() = orientation.normalized().toRotationMatrix();
  scan.T_map_sensor.translation() = cloud.sensor_origin_.template head<3>().template cast<double>();
  scan.stamp_s = static_cast<double>(cloud.header.stamp) * 1e-6;
  scan.name = cloud.header.frame_id;
  scan.points.reserve(cloud.size());
  for (const Point& p : cloud) {
    const Eigen::Vector3f point(p.x, p.y, p.z);
    scan.points.push_back(point.isZero(0) ? Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN())
                                          : point);
  }
  scan.sensor = sensor_of_frame(scan.name);
  return scan;
}

/// The map's points in its frame, labelled by their surface, its id's low 32 bits; 0: pending. O(points).
inline pcl::PointCloud<pcl::PointXYZL> to_labelled_cloud(const Map& map) {
  pcl::PointCloud<pcl::PointXYZL> cloud;
  map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    const Eigen::Vector3f p = voxel.point.cast<float>();
    cloud.push_back({p.x(), p.y(), p.z(), static_cast<std::uint32_t>(voxel.surface)});
  });
  return cloud;
}

/// n·x − offset as PCL's a b c d: a·x + b·y + c·z + d = 0, map frame.
inline pcl::ModelCoefficients to_model_coefficients(const Plane& plane) {
  pcl::ModelCoefficients coefficients;
  for (const double n : plane.normal) coefficients.values.push_back(static_cast<float>(n));
  coefficients.values.push_back(static_cast<float>(-plane.offset));
  return coefficients;
}

/// Converts any octosurf mesh, such as extrude(surface, 0.02): map frame.
inline pcl::PolygonMesh to_polygon_mesh(const Mesh& mesh) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const Eigen::Vector3f p = v.cast<float>();
    cloud.push_back({p.x(), p.y(), p.z()});
  }
  pcl::PolygonMesh result;
  pcl::toPCLPointCloud2(cloud, result.cloud);
  for (const auto& t : mesh.triangles) {
    pcl::Vertices corners;
    for (const std::uint32_t i : t) corners.vertices.push_back(static_cast<pcl::index_t>(i));
    result.polygons.push_back(corners);
  }
  return result;
}

namespace detail {

/// The integral of (u, v, 1)·(u, v, 1)ᵀ over a ring's area, by Green's theorem; negative for a hole, which is
/// clockwise.
inline Eigen::Matrix3d moments_of(const Ring2& ring) {
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < ring.size(); ++i) {  // a triangle with the origin for each edge
    const Eigen::Vector3d o = Eigen::Vector3d::UnitZ(), a = ring[i].homogeneous(),
                          b = ring[(i + 1) % ring.size()].homogeneous(), sum = o + a + b;
    moments += (a.x() * b.y() - b.x() * a.y()) / 24 *
               (sum * sum.transpose() + o * o.transpose() + a * a.transpose() + b * b.transpose());
  }
  return moments;
}

}  // namespace detail

/// One region for each polygon of the surface, map frame. PlanarRegion has no holes: `contour` is the outer
/// ring. Centroid and covariance are those of points spread evenly over the polygon without its holes, with
/// rms_m across the plane; the count is its share of the inliers by area.
inline std::vector<pcl::PlanarRegion<pcl::PointXYZ>> to_planar_regions(const Surface& surface) {
  std::vector<pcl::PlanarRegion<pcl::PointXYZ>> regions;
  const Eigen::Matrix3d R = surface.T_map_surface.linear();
  Eigen::Vector4f plane;
  plane << surface.plane.normal.cast<float>(), static_cast<float>(-surface.plane.offset);
  for (const Polygon& polygon : surface.polygons) {
    Eigen::Matrix3d moments = detail::moments_of(polygon.outer);
    for (const Ring2& hole : polygon.holes) moments += detail::moments_of(hole);
    const double area = moments(2, 2);
    const Eigen::Vector2d mean = moments.topRightCorner<2, 1>() / area;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    spread.topLeftCorner<2, 2>() = moments.topLeftCorner<2, 2>() / area - mean * mean.transpose();
    spread(2, 2) = surface.rms_m * surface.rms_m;
    pcl::PointCloud<pcl::PointXYZ>::VectorType contour;
    for (const Eigen::Vector2d& uv : polygon.outer) {
      const Eigen::Vector3f p = surface.to_map(uv).cast<float>();
      contour.push_back({p.x(), p.y(), p.z()});
    }
    const double share = surface.area_m2 > 0 ? area / surface.area_m2 : 0;
    regions.emplace_back(surface.to_map(mean).cast<float>(), (R * spread * R.transpose()).cast<float>(),
                         static_cast<unsigned>(std::lround(share * static_cast<double>(surface.inliers))),
                         contour, plane);
  }
  return regions;
}

}  // namespace octosurf
