// A lens' distortion, undone: against the forward projection, which is OpenCV's formula written out.
#include "io/readers/lens.hpp"

#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::test {
namespace {

using Slopes = Eigen::Vector2d;

/// docs.opencv.org, calib3d: the distortion of the points (x, y) of the plane at depth 1.
Slopes seen_by_opencv(const io::Lens& lens, double x, double y) {
  const auto k = [&](std::size_t i) { return i < lens.d.size() ? lens.d[i] : 0; };
  const double r = std::hypot(x, y);
  if (lens.model == "equidistant") {
    const double t = std::atan(r);
    const double bent =
        t + k(0) * std::pow(t, 3) + k(1) * std::pow(t, 5) + k(2) * std::pow(t, 7) + k(3) * std::pow(t, 9);
    return Slopes(x, y) * (r == 0 ? 1 : bent / r);
  }
  const double above = 1 + k(0) * std::pow(r, 2) + k(1) * std::pow(r, 4) + k(4) * std::pow(r, 6);
  const double below = 1 + k(5) * std::pow(r, 2) + k(6) * std::pow(r, 4) + k(7) * std::pow(r, 6);
  return {x * above / below + 2 * k(2) * x * y + k(3) * (r * r + 2 * x * x),
          y * above / below + k(2) * (r * r + 2 * y * y) + 2 * k(3) * x * y};
}

/// Of a Kinect v1, an Azure Kinect and a RealSense T265.
const std::vector<io::Lens> lenses{
    {"plumb_bob", {0.0957, -0.2481, -0.0012, 0.0024, 0.1173}},
    {"plumb_bob", {-0.28, 0.09, 0.0005, -0.0003}},
    {"rational_polynomial", {5.55, 3.53, 0.00006, -0.00009, 0.17, 5.88, 5.31, 0.93}},
    {"equidistant", {-0.0078, 0.0424, -0.0396, 0.0067}}};

TEST(Lens, RaysAreFoundBackFromWhereTheyAreSeen) {
  auto random = rng();
  std::uniform_real_distribution<double> slope(-0.7, 0.7);
  for (const io::Lens& lens : lenses)
    for (int i = 0; i < 1000; ++i) {
      const Slopes ray(slope(random), slope(random));
      const Slopes seen = seen_by_opencv(lens, ray.x(), ray.y());
      EXPECT_LT((io::distorted(lens, ray) - seen).norm(), 1e-12) << lens.model;
      const auto found = io::undistorted(lens, seen, io::reach_of(lens));
      ASSERT_TRUE(found) << lens.model << ' ' << ray.transpose();
      EXPECT_LT((*found - ray).norm(), 1e-6) << lens.model;
    }
  const auto wide =
      io::undistorted(lenses.back(), seen_by_opencv(lenses.back(), 4, -1), io::reach_of(lenses.back()));
  ASSERT_TRUE(wide) << "of a field of view of 150 degrees";
  EXPECT_LT((*wide - Slopes(4, -1)).norm(), 1e-6);
}

/// Its radius grows to 0.667 at a slope of 1, and falls again: the ray of a place has a twin farther out.
TEST(Lens, RaysAreNotSoughtWhereTheFormulaTurnsBack) {
  const io::Lens lens{"plumb_bob", {-1.0 / 3, 0, 0, 0, 0}};
  EXPECT_NEAR(io::reach_of(lens), 1, 0.011);
  for (const double ray : {0.5, 0.9, 0.98})
    EXPECT_NEAR(io::undistorted(lens, seen_by_opencv(lens, ray, 0), 1).value().x(), ray, 1e-6);
  EXPECT_FALSE(io::undistorted(lens, {0.7, 0}, 1));
}

/// A wall at 2 m, each pixel on its ray.
TEST(Lens, PointsOfAnImageComeToTheirRays) {
  const io::Intrinsics camera{50, 55, 31.5, 23.5};
  for (const io::Lens& lens : lenses) {
    std::vector<Eigen::Vector3f> points;
    for (int v = 0; v < 48; v += 3)
      for (int u = 0; u < 64; u += 2)
        points.emplace_back(2 * static_cast<float>((u - camera.cx) / camera.fx),
                            2 * static_cast<float>((v - camera.cy) / camera.fy), 2.0F);
    const auto pinhole = points;
    io::undistort(points, camera, lens, 64, 48);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].allFinite()) continue;
      EXPECT_EQ(points[i].z(), 2);
      const Slopes seen = seen_by_opencv(lens, static_cast<double>(points[i].x() / 2),
                                         static_cast<double>(points[i].y() / 2));
      EXPECT_LT((2 * seen.cast<float>() - pinhole[i].head<2>()).norm(), 1e-4F) << lens.model << i;
    }
  }
}

}  // namespace
}  // namespace octosurf::test
