// Up, found from a map that was made from scans.
#include "support/checked_mapper.hpp"
#include "support/degree.hpp"
#include "support/guarantees.hpp"
#include "support/scene.hpp"
#include "surfaces/blobs.hpp"

#include <octosurf/up.hpp>

namespace octosurf::mapper {
namespace {

using Eigen::Vector3d;

double angle(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// A narrow passage: 3.6 m² of wall on each side of 1.4 m² of floor, and a step.
test::Scene passage() {
  test::Scene scene;
  scene.rectangle({-1, -0.35, 0}, {2, 0, 0}, {0, 0.7, 0});
  scene.rectangle({-1, -0.35, 0}, {2, 0, 0}, {0, 0, 1.8}).rectangle({-1, 0.35, 0}, {2, 0, 0}, {0, 0, 1.8});
  scene.box({0.5, -0.34, 0}, {0.98, 0.34, 0.2});
  return scene;
}

std::vector<Scan> walk(std::mt19937_64& rng) {
  std::vector<Scan> scans;
  test::Camera camera;
  camera.width = 120;
  camera.height = 160;
  camera.focal = 90;
  const test::Scene scene = passage();
  for (const double x : {-0.9, -0.6, -0.3})
    for (const double aside : {-0.5, 0.0, 0.5})
      scans.push_back(
          test::camera_scan(scene, test::look_at({x, 0, 1.2}, {x + 1, aside, 0.55}), rng, camera));
  return scans;
}

Parameters estimating() {
  Parameters parameters;
  parameters.up.reset();
  return parameters;
}

TEST(UpOfAMap, IsFoundHoweverItsFrameIsTurned) {
  std::mt19937_64 rng(test::seed());
  std::normal_distribution<double> gauss;
  const std::vector<Scan> scans = walk(rng);
  for (int world = 0; world < 3; ++world) {
    const Eigen::Isometry3d R(
        Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized());
    Mapper mapper(estimating());
    for (const Scan& scan : scans) mapper.insert(test::moved(scan, R));
    const Up up = up_of(mapper.map());
    EXPECT_EQ(up.source, Up::Source::surfaces);
    EXPECT_LT(angle(up.direction, R.linear().col(2)), 0.5 * test::degree);
    const Up alone = estimate_up(*mapper.snapshot());
    EXPECT_GT(angle(alone.direction, R.linear().col(2)), 80 * test::degree)
        << "without the camera it is a wall";
  }
}

TEST(UpOfAMap, LidarsStandOnTheirZ) {
  Mapper mapper(estimating());
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor = Eigen::Isometry3d(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()));
  for (double u = -1; u <= 1; u += 0.015)
    for (double v = -1; v <= 1; v += 0.015) {
      scan.points.push_back(Eigen::Vector3d(u, v, -1).cast<float>());         // the floor, below the sensor
      scan.points.push_back(Eigen::Vector3d(u, 1.5, 1.5 * v).cast<float>());  // a larger wall
    }
  mapper.insert(scan);
  EXPECT_LT(angle(up_of(mapper.map()).direction, -Vector3d::UnitY()), 0.1 * test::degree);
}

TEST(UpOfAMap, ChangesNothingElse) {
  std::mt19937_64 rng(test::seed());
  const std::vector<Scan> scans = walk(rng);
  Parameters sideways;
  sideways.up = Vector3d::UnitX();
  const Mapper one = test::mapped(scans), other = test::mapped(scans, sideways);
  EXPECT_TRUE(test::leaves_of(one.map()) == test::leaves_of(other.map()));
  const std::vector<SurfacePtr> of_one = one.snapshot()->surfaces, of_other = other.snapshot()->surfaces;
  ASSERT_EQ(of_one.size(), of_other.size());
  for (std::size_t i = 0; i < of_one.size(); ++i)
    EXPECT_TRUE(test::identical(of_one[i]->polygons, of_other[i]->polygons)) << i;
}

}  // namespace
}  // namespace octosurf::mapper
