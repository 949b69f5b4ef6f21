// PCL's types in and out.
#include "geometry/triangulate.hpp"
#include "io/exporters/room_snapshot.hpp"
#include "planning/shapes.hpp"
#include "support/random_scans.hpp"

#include <octosurf/adapters/pcl.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

TEST(PclScan, HasTheCloudsPointsPoseTimeAndSensor) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  cloud.push_back({1, 2, 3, 7});
  cloud.push_back({0, 0, 0, 7});
  cloud.sensor_origin_ = {4, 5, 6, 0};
  cloud.sensor_orientation_ = Eigen::AngleAxisf(0.3F, Eigen::Vector3f(1, 2, -2).normalized());
  cloud.header.stamp = 1'500'000;
  cloud.header.frame_id = "lidar";
  const Scan scan = to_scan(cloud);
  ASSERT_EQ(scan.points.size(), 2u);
  EXPECT_EQ(scan.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_TRUE(scan.points[1].hasNaN());
  EXPECT_EQ(scan.T_map_sensor.translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_TRUE(
      scan.T_map_sensor.linear().cast<float>().isApprox(cloud.sensor_orientation_.toRotationMatrix(), 1e-6F));
  EXPECT_EQ(scan.stamp_s, 1.5);
  EXPECT_EQ(scan.sensor, SensorKind::lidar);
  EXPECT_EQ(scan.name, "lidar");
  EXPECT_NO_THROW(require_rigid(scan.T_map_sensor, "scan"));

  cloud.header.frame_id = "camera_depth_optical_frame";
  EXPECT_EQ(to_scan(cloud).sensor, SensorKind::depth_camera);
  cloud.sensor_orientation_.coeffs().setZero();
  EXPECT_THROW(to_scan(cloud), Error);
}

TEST(PclCloud, IsLabelledBySurface) {
  std::mt19937_64 random = test::rng();
  Mapper mapper;
  mapper.insert(test::room_scan(random, 20000, {1.5, 1, 1.2}));
  const Map& map = mapper.map();
  const pcl::PointCloud<pcl::PointXYZL> cloud = to_labelled_cloud(map);
  EXPECT_EQ(cloud.size(), map.size().points);
  std::map<SurfaceId, std::size_t> labels;
  for (const pcl::PointXYZL& p : cloud) {
    ++labels[p.label];
    EXPECT_EQ(map.at(Eigen::Vector3d(p.x, p.y, p.z)).surface, p.label);
  }
  EXPECT_EQ(labels[0], map.size().pending);
  for (const SurfacePtr& surface : map.snapshot()->surfaces) EXPECT_EQ(labels[surface->id], surface->inliers);
}

TEST(PclPlane, CoefficientsVanishOnTheSurface) {
  const Snapshot room = test::make_room();
  for (const SurfacePtr& surface : room.surfaces) {
    const pcl::ModelCoefficients c = to_model_coefficients(surface->plane);
    ASSERT_EQ(c.values.size(), 4u);
    for (const Eigen::Vector3d& p : surface->boundary)
      EXPECT_NEAR(c.values[0] * p.x() + c.values[1] * p.y() + c.values[2] * p.z() + c.values[3], 0, 1e-5);
  }
}

TEST(PclMesh, HasTheTrianglesOfOurs) {
  const Snapshot room = test::make_room();
  const Mesh mesh = extrude(*room.surfaces[0], 0.02);
  const pcl::PolygonMesh theirs = to_polygon_mesh(mesh);
  pcl::PointCloud<pcl::PointXYZ> vertices;
  pcl::fromPCLPointCloud2(theirs.cloud, vertices);
  ASSERT_EQ(vertices.size(), mesh.vertices.size());
  ASSERT_EQ(theirs.polygons.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    ASSERT_EQ(theirs.polygons[i].vertices.size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
      const pcl::PointXYZ& p = vertices[static_cast<std::size_t>(theirs.polygons[i].vertices[k])];
      EXPECT_LT((p.getVector3fMap().cast<double>() - mesh.vertices[mesh.triangles[i][k]]).norm(), 1e-6);
    }
  }
}

/// Centroid and covariance of points spread over the polygon, by sampling its triangles.
std::pair<Eigen::Vector2d, Eigen::Matrix2d> sampled_moments(const Polygon& polygon, std::mt19937_64& random) {
  std::vector<Eigen::Vector2d> vertices;
  const auto triangles = geometry::triangulate(polygon, vertices);
  std::vector<double> areas;
  for (const auto& t : triangles)
    areas.push_back(shapes::ring_area({vertices[t[0]], vertices[t[1]], vertices[t[2]]}));
  std::discrete_distribution<std::size_t> one(areas.begin(), areas.end());
  std::uniform_real_distribution<double> share(0, 1);
  constexpr int samples = 40000;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (int i = 0; i < samples; ++i) {
    const auto& t = triangles[one(random)];
    double a = share(random), b = share(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const Eigen::Vector2d p =
        vertices[t[0]] + a * (vertices[t[1]] - vertices[t[0]]) + b * (vertices[t[2]] - vertices[t[0]]);
    sum += p;
    squares += p * p.transpose();
  }
  const Eigen::Vector2d mean = sum / samples;
  return {mean, squares / samples - mean * mean.transpose()};
}

TEST(PclRegion, HasContourPlaneAndMomentsOfThePolygon) {
  std::mt19937_64 random = test::rng();
  for (int round = 0; round < 10; ++round) {
    Surface surface = *test::make_room().surfaces[3];
    surface.polygons = {shapes::random_polygon(random)};
    surface.area_m2 = shapes::area(surface.polygons[0]);
    const auto regions = to_planar_regions(surface);
    ASSERT_EQ(regions.size(), 1u);
    const auto [mean, covariance] = sampled_moments(surface.polygons[0], random);
    EXPECT_LT((regions[0].getCentroid().cast<double>() - surface.to_map(mean)).norm(), 0.05);
    const Eigen::Matrix3d R = surface.T_map_surface.linear();
    const Eigen::Matrix3d spread = R.transpose() * regions[0].getCovariance().cast<double>() * R;
    EXPECT_LT((spread.topLeftCorner<2, 2>() - covariance).norm(), 0.05 * covariance.norm());
    EXPECT_NEAR(spread(2, 2), surface.rms_m * surface.rms_m, 1e-6);
    EXPECT_EQ(regions[0].getCount(), surface.inliers);
    EXPECT_EQ(regions[0].getContour().size(), surface.polygons[0].outer.size());
    const Eigen::Vector4f plane = regions[0].getCoefficients();
    for (const pcl::PointXYZ& p : regions[0].getContour())
      EXPECT_NEAR(plane.dot(Eigen::Vector4f(p.x, p.y, p.z, 1)), 0, 1e-5);
  }
}

}  // namespace
}  // namespace octosurf
