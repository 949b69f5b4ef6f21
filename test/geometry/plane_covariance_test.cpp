// How sure a surface says its plane is, against how much planes through many noisy draws really scatter.
#include "geometry/plane_covariance.hpp"

#include "surfaces/blobs.hpp"
#include "surfaces/surface_model.hpp"

namespace octosurf::geometry {
namespace {

using test::noise_of;

/// A point of the true plane z = 0, with the noise it is drawn with along the normal.
struct Reading {
  Eigen::Vector2d uv;
  std::uint8_t range_class;
  double sigma;
  double observed_weight = 0;  // above 0: what later scans saw again
  double height = 0;           // of the mean over the true plane
};

/// An oblong patch 0.8 by 0.2 m, all of it to one side of the frame's origin.
std::vector<Reading> patch(const std::function<void(Reading&)>& adjust) {
  std::vector<Reading> readings;
  for (int i = 0; i < 40; ++i)
    for (int k = 0; k < 10; ++k) {
      readings.push_back({{0.1 + 0.02 * i, -0.1 + 0.02 * k}, 1, 0.005});
      adjust(readings.back());
    }
  return readings;
}

struct Draw {
  Eigen::Vector3d plane;       // slopes and offset of the fitted plane over the true frame
  Eigen::Matrix3d covariance;  // that it says
};

Draw draw(const std::vector<Reading>& readings, const sensing::NoiseModel& noise,
          const Eigen::Isometry3d& pose, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  surfaces::SurfaceModel model(1, {pose.linear().col(2), pose.linear().col(2).dot(pose.translation())},
                               pose.translation(), 0.02);
  const Eigen::Isometry3d T = model.pose();  // its axes in the plane are its own
  std::uint16_t k = 0;
  for (const Reading& r : readings) {
    const Eigen::Vector3f p =
        (T * Eigen::Vector3d(r.uv.x(), r.uv.y(), r.height + r.sigma * gauss(rng))).cast<float>();
    if (r.observed_weight > 0)
      model.observe(p, r.observed_weight);
    else
      model.add({{k++, 0, 0}, r.range_class, p});
  }
  const PlaneFit fit = fit_plane(model.moments(&noise));
  Plane plane{fit.normal.dot(T.linear().col(2)) < 0 ? Eigen::Vector3d(-fit.normal) : fit.normal, 0};
  plane.offset = plane.normal.dot(model.reference() + fit.centroid);
  model.set_plane(plane);
  model.derive_covariance(noise);
  const Eigen::Vector3d n = T.linear().transpose() * plane.normal;
  return {{-n.x() / n.z(), -n.y() / n.z(), -plane.signed_distance(T.translation()) / n.z()},
          model.publish(1)->covariance};
}

/// In no direction of (slope, slope, offset) do the planes scatter otherwise than said, up to `slack`.
void expect_scatter_as_said(const std::vector<Reading>& readings, const sensing::NoiseModel& noise,
                            const Eigen::Isometry3d& pose, std::mt19937_64& rng, double slack = 0.3) {
  constexpr int draws = 400;  // which leave the scatter itself unsure by some 4 % to 9 %
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero(), said = Eigen::Matrix3d::Zero();
  for (int i = 0; i < draws; ++i) {
    const Draw d = draw(readings, noise, pose, rng);
    EXPECT_EQ(d.covariance, d.covariance.transpose());
    EXPECT_EQ(d.covariance.llt().info(), Eigen::Success);
    scatter += d.plane * d.plane.transpose() / draws;
    said += d.covariance / draws;
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> ratio(scatter, said);
  const Eigen::Vector3d of_std = ratio.eigenvalues().cwiseSqrt();
  EXPECT_GT(of_std.minCoeff(), 1 - slack);
  EXPECT_LT(of_std.maxCoeff(), 1 + slack);
}

Eigen::Isometry3d tilted(const Eigen::Vector3d& origin) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 0.8, 0.2).normalized()).toRotationMatrix();
  pose.translation() = origin;
  return pose;
}

/// Also of a sensor that is more exact or noisier than is said, far from the origin, where a float is good to
/// 0.03 mm, and where far points count less.
TEST(PlaneCovariance, IsHowMuchFittedPlanesScatter) {
  std::mt19937_64 rng(test::seed());
  for (const double sigma : {0.005, 0.001, 0.01})
    expect_scatter_as_said(patch([&](Reading& r) { r.sigma = sigma; }), noise_of(0.005), tilted({1, 2, 3}),
                           rng);
  expect_scatter_as_said(patch([](Reading&) {}), noise_of(0.005), tilted({400, -300, 100}), rng);
  const sensing::NoiseModel noise = noise_of(0.005, 0.003);
  expect_scatter_as_said(patch([&](Reading& r) {
                           r.range_class = r.uv.x() > 0.4 ? 9 : 1;
                           r.sigma = noise.sigma(r.range_class);
                         }),
                         noise, tilted({1, 2, 3}), rng);
}

TEST(PlaneCovariance, WhatWasSeenAgainMakesItSurer) {
  std::mt19937_64 rng(test::seed());
  const sensing::NoiseModel noise = noise_of(0.005);
  std::vector<Reading> readings = patch([](Reading&) {});
  const std::size_t first_readings = readings.size();
  const Draw once = draw(readings, noise, tilted({1, 2, 3}), rng);
  // Means of four points, from 30 further scans.
  for (int scan = 0; scan < 30; ++scan)
    for (Reading r : patch([](Reading&) {})) {
      r.sigma = 0.0025;
      r.observed_weight = 4;
      readings.push_back(r);
    }
  const Draw often = draw(readings, noise, tilted({1, 2, 3}), rng);
  // 1 + 30·4 times the information. What n readings scatter says of their noise is right to 1/√(2 (n -
  // 3)); 4.5 of that are left in one of 100,000 worlds.
  const double bound = 4.5 * 11 / std::sqrt(2.0 * (static_cast<double>(first_readings) - 3));
  EXPECT_NEAR(std::sqrt(once.covariance(0, 0) / often.covariance(0, 0)), std::sqrt(121), bound);
  EXPECT_NEAR(std::sqrt(once.covariance(2, 2) / often.covariance(2, 2)), std::sqrt(121), bound);
  expect_scatter_as_said(readings, noise, tilted({1, 2, 3}), rng);
}

/// Rays keep the voxels before a plane free and leave those behind it, and an inlier counts as much when
/// noise reached it once: where later scans tell that the inliers lie deeper, the offset errs by what they
/// weigh.
TEST(PlaneCovariance, SaysHowFarInliersThatLieTooDeepMoveThePlane) {
  std::mt19937_64 rng(test::seed());
  const sensing::NoiseModel noise = noise_of(0.005);
  constexpr double too_deep = 0.003, sigma = 0.001, weight = 3;
  std::vector<Reading> readings = patch([](Reading& r) {
    r.uv.x() -= 0.49;  // about the origin
    r.sigma = sigma;
    r.height = -too_deep;
  });
  const std::size_t inliers = readings.size();
  for (std::size_t i = 0; i < inliers; ++i) {
    readings.push_back(readings[i]);
    readings.back().observed_weight = weight;
    readings.back().height = 0;
  }
  const Draw deep = draw(readings, noise, tilted({1, 2, 3}), rng);
  const double moved = too_deep / (1 + weight);
  // The plane's height is right to 0.04 mm, by √(1 + 9) of 4 readings' noise over 20; 4.5 of that are left.
  EXPECT_NEAR(deep.plane.z(), -moved, 2e-4);
  EXPECT_NEAR(std::sqrt(deep.covariance(2, 2)), moved, 2e-4);
  for (Reading& r : readings) r.height = 0;
  const Draw right = draw(readings, noise, tilted({1, 2, 3}), rng);
  EXPECT_LT(std::sqrt(right.covariance(2, 2)), 2e-4) << "chance makes no bias";
}

TEST(PlaneCovariance, OfPointsWithoutNoiseAndOfALineIsDefinite) {
  std::mt19937_64 rng = test::rng();
  const Draw exact = draw(patch([](Reading& r) { r.sigma = 0; }), noise_of(0.005), tilted({1, 2, 3}), rng);
  EXPECT_EQ(exact.covariance.llt().info(), Eigen::Success);
  EXPECT_LT(std::sqrt(exact.covariance(0, 0)), 1e-4) << "rad";
  Moments line;
  for (int i = 0; i < 100; ++i) line.add({0.01 * i, 0, i % 2 == 0 ? 0.005 : -0.005});
  const Eigen::Matrix3d of_line = plane_over(line, Eigen::Matrix3d::Identity(), 100).covariance;
  EXPECT_EQ(of_line.llt().info(), Eigen::Success);
  EXPECT_GT(std::sqrt(of_line(2, 2)), 0.5) << "rad: nothing is known across a line";
}

TEST(PlaneCovariance, FollowsFromTheTextbookOnASquareGrid) {
  // Of N points at unit weight about their centroid: Var(offset) = σ²/N, Var(slope) = σ²/Σu².
  std::vector<Reading> readings;
  double squares = 0;
  for (int i = -20; i <= 20; ++i)
    for (int k = -20; k <= 20; ++k) {
      readings.push_back({{0.02 * i, 0.02 * k}, 1, 0.005});
      squares += std::pow(0.02 * i, 2);
    }
  std::mt19937_64 rng(test::seed());
  const Draw d = draw(readings, noise_of(0.005), tilted({1, 2, 3}), rng);
  // σ² out of 1681 residuals is good to 3.5 %.
  EXPECT_NEAR(std::sqrt(d.covariance(2, 2)), 0.005 / 41, 0.1 * 0.005 / 41);
  EXPECT_NEAR(std::sqrt(d.covariance(0, 0)), 0.005 / std::sqrt(squares), 0.1 * 0.005 / std::sqrt(squares));
  EXPECT_NEAR(std::sqrt(d.covariance(1, 1)), 0.005 / std::sqrt(squares), 0.1 * 0.005 / std::sqrt(squares));
  Surface surface;
  surface.covariance = d.covariance;
  EXPECT_DOUBLE_EQ(surface.offset_std_m(), std::sqrt(d.covariance(2, 2)));
  EXPECT_NEAR(surface.normal_std_rad(), 0.005 / std::sqrt(squares), 0.1 * 0.005 / std::sqrt(squares));
}

}  // namespace
}  // namespace octosurf::geometry
