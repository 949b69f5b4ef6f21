// A sensor is what its rays say, in any order and any frame a driver uses.
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <octosurf/sensor.hpp>

namespace octosurf::test {
namespace {

using Points = std::vector<Eigen::Vector3f>;
using ::testing::HasSubstr;

constexpr double degree = std::numbers::pi / 180;

/// Where the ray meets a hall of 20 × 8 × 4 m around the sensor, in which a millimetre of noise is no wall's.
Eigen::Vector3d in_the_hall(const Eigen::Vector3d& ray, std::mt19937& random) {
  const Eigen::Vector3d high(10, 4, 3), low(-10, -4, -1);
  double range = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis)
    if (ray[axis] != 0) range = std::min(range, (ray[axis] > 0 ? high : low)[axis] / ray[axis]);
  return ray * (range + std::normal_distribution<>(0, 0.01 / ray.norm())(random));
}

Points seen_along(const std::vector<Eigen::Vector3d>& rays) {
  std::mt19937 random(1);  // fixed: noise that no limit is near
  Points points;
  for (const Eigen::Vector3d& ray : rays) points.push_back(in_the_hall(ray, random).cast<float>());
  return points;
}

/// `bend`: radial distortion, the first coefficient.
Points camera(int width, int height, double focal_length, double bend = 0) {
  std::vector<Eigen::Vector3d> rays;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d at((u - width / 2.0 + 0.5) / focal_length,
                               (v - height / 2.0 + 0.5) / focal_length);
      const Eigen::Vector2d bent = at * (1 + bend * at.squaredNorm());
      rays.emplace_back(bent.x(), bent.y(), 1);
    }
  return seen_along(rays);
}

/// Rings `rings` between ±`high` degrees, columns between ±`half` degrees of azimuth.
Points spinning(int columns, int rings, double high, double half) {
  std::vector<Eigen::Vector3d> rays;
  for (int row = 0; row < rings; ++row)
    for (int column = 0; column < columns; ++column) {
      const double elevation = degree * high * (1 - 2.0 * row / (rings - 1));
      const double azimuth = degree * half * (2.0 * column / columns - 1);
      rays.emplace_back(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                        std::sin(elevation));
    }
  return seen_along(rays);
}

/// A rosette around x, as two prisms make it.
Points rosette(int readings) {
  std::vector<Eigen::Vector3d> rays;
  for (int i = 0; i < readings; ++i) {
    const double slope = 0.7 * std::abs(std::sin(0.0371 * i)), turn = 0.0728 * i;
    rays.emplace_back(1, slope * std::cos(turn), slope * std::sin(turn));
  }
  return seen_along(rays);
}

Points changed(Points points, const std::function<Eigen::Vector3f(const Eigen::Vector3f&)>& change) {
  for (Eigen::Vector3f& p : points) p = change(p);
  return points;
}

Points shuffled(Points points) {
  std::mt19937 random(7);  // fixed: any order
  std::shuffle(points.begin(), points.end(), random);
  return points;
}

Points with_holes(Points points) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (i % 7 == 0) points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
  return points;
}

void expect_kind(const Points& points, SensorKind kind, const std::string& why) {
  for (const Points& same : {points, shuffled(points), with_holes(points)}) {
    const SensorGuess guess = guess_sensor(same);
    EXPECT_EQ(guess.kind, kind) << guess.why;
    EXPECT_THAT(guess.why, HasSubstr(why));
  }
}

TEST(SensorGuess, ACameraHasAnEvenRaster) {
  expect_kind(camera(160, 120, 120), SensorKind::depth_camera, "raster of 67 x 53°");
  expect_kind(camera(640, 480, 525), SensorKind::depth_camera, "raster of 63 x 49°");
  expect_kind(camera(256, 256, 128), SensorKind::depth_camera, "raster of 90 x 90°");
}

TEST(SensorGuess, ACameraStaysOneInABodysFrameBentByItsLensOrRounded) {
  const auto to_body = [](const Eigen::Vector3f& p) { return Eigen::Vector3f(p.z(), -p.x(), -p.y()); };
  expect_kind(changed(camera(320, 240, 260), to_body), SensorKind::depth_camera, "raster");
  EXPECT_EQ(guess_sensor(changed(camera(320, 240, 260), to_body)).axis, 0);
  EXPECT_EQ(guess_sensor(camera(320, 240, 260)).axis, 2);
  EXPECT_EQ(guess_sensor(camera(320, 240, 260, 0.1)).kind, SensorKind::depth_camera);
  EXPECT_EQ(guess_sensor(camera(320, 240, 260, -0.15)).kind, SensorKind::depth_camera);
  const auto to_millimetres = [](const Eigen::Vector3f& p) {
    return Eigen::Vector3f((p * 1000).array().round() / 1000);
  };
  EXPECT_EQ(guess_sensor(changed(camera(320, 240, 260), to_millimetres)).kind, SensorKind::depth_camera);
  Points tenth;
  for (const Eigen::Vector3f& p : shuffled(camera(640, 480, 525)))
    if (tenth.size() < 30000) tenth.push_back(p);
  EXPECT_EQ(guess_sensor(tenth).kind, SensorKind::depth_camera);
}

TEST(SensorGuess, ASpinningLidarHasRings) {
  expect_kind(spinning(1024, 64, 45, 180), SensorKind::lidar, "spinning lidar");
  expect_kind(spinning(512, 32, 45, 180), SensorKind::lidar, "spinning lidar");
  expect_kind(spinning(1800, 16, 15, 180), SensorKind::lidar, "spinning lidar");
}

TEST(SensorGuess, APartOfALidarsTurnIsNoCamera) {
  for (const double half : {20.0, 30.0, 45.0, 60.0}) {
    const auto columns = static_cast<int>(half * 1024 / 180);
    expect_kind(spinning(columns, 128, 22.5, half), SensorKind::lidar, "");  // as far apart in both angles
    expect_kind(spinning(columns, 16, 15, half), SensorKind::lidar, "");
  }
}

TEST(SensorGuess, ASolidStateLidarHasNeither) {
  expect_kind(rosette(24000), SensorKind::lidar, "solid-state");
  Points repeated = rosette(24000);
  for (int i = 0; i < 3; ++i) std::ranges::copy(rosette(24000), std::back_inserter(repeated));
  expect_kind(repeated, SensorKind::lidar, "solid-state");
  std::vector<Eigen::Vector3d> raster;  // of equal angles
  for (double azimuth = -60; azimuth < 60; azimuth += 0.2)
    for (double elevation = -12.5; elevation < 12.5; elevation += 0.2)
      raster.emplace_back(std::cos(degree * elevation) * std::cos(degree * azimuth),
                          std::cos(degree * elevation) * std::sin(degree * azimuth),
                          std::sin(degree * elevation));
  expect_kind(seen_along(raster), SensorKind::lidar, "lidar");
}

TEST(SensorGuess, AComposedCloudHidesItsReadings) {
  // A ball, seen from all sides.
  Points composed;
  for (int i = 0; i < 5000; ++i) {
    const double z = 1 - (2 * i + 1) / 5000.0, turn = 2.399963 * i, r = std::sqrt(1 - z * z);
    composed.push_back(
        Eigen::Vector3d(5 + 2 * r * std::cos(turn), 2 * r * std::sin(turn), 2 * z).cast<float>());
  }
  expect_kind(composed, SensorKind::lidar, "composed cloud");
}

TEST(SensorGuess, AFewReadingsSayNothing) {
  EXPECT_EQ(guess_sensor(Points(99, {1, 2, 3})).why, "");
  EXPECT_EQ(guess_sensor(Points(1000, Eigen::Vector3f::Zero())).why, "");
  EXPECT_EQ(guess_sensor({}).kind, SensorKind::lidar);
}

}  // namespace
}  // namespace octosurf::test
