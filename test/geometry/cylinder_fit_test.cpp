#include "geometry/cylinder_fit.hpp"

#include "geometry/plane_covariance.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::geometry {
namespace {

constexpr double pi = std::numbers::pi;

/// Points on a lateral surface about the pose's z axis, with noise along the normal.
struct Lateral {
  double radius = 0.15, length = 1, from = 0, span = pi, noise = 0;
  std::size_t points = 500;

  std::vector<CylinderSample> samples(const Eigen::Isometry3d& pose, std::mt19937_64& rng) const {
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> gauss(0, 1);
    std::vector<CylinderSample> all;
    for (std::size_t i = 0; i < points; ++i) {
      const double a = from + span * unit(rng), z = length * (unit(rng) - 0.5);
      const Eigen::Vector3d n(std::cos(a), std::sin(a), 0);
      all.push_back({pose * Eigen::Vector3d((radius + noise * gauss(rng)) * n + Eigen::Vector3d(0, 0, z)),
                     std::max(noise, 1e-4)});
    }
    return all;
  }
};

/// A shape as two noisy normals might give it.
CylinderShape rough(const Eigen::Isometry3d& pose, double radius, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss(0, 1);
  const auto any = [&] { return Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng)).normalized(); };
  return {pose.translation() + 0.2 * radius * any(), (pose.linear().col(2) + 0.1 * any()).normalized(),
          1.2 * radius};
}

double tilt_deg(const CylinderShape& shape, const Eigen::Isometry3d& pose) {
  return std::acos(std::min(1.0, std::fabs(shape.axis.dot(pose.linear().col(2))))) * 180 / pi;
}

/// Between the axes, where the middle is.
double off_axis(const CylinderShape& shape, const Eigen::Isometry3d& pose) {
  return shape.from_axis(pose.translation()).norm();
}

TEST(CylinderFit, StandsNoiseAndBeingFarFromTheOrigin) {
  // Least squares over 500 points on an arc of 120° knows the radius to 1.3 mm where the noise is 5 mm
  // (σ/√n · √(mean cos² / variance of cos)); the bounds are over five times that.
  std::mt19937_64 rng(test::seed());
  struct Case {
    double radius, span, noise, far, largest_error, largest_tilt_deg, largest_off_axis;
  };
  for (const Case& c :
       {Case{0.02, 0.75 * pi, 0, 0, 1e-6, 1e-3, 1e-6}, Case{0.4, 2 * pi, 0, 0, 1e-6, 1e-3, 1e-6},
        Case{0.02, 2 * pi, 0, 500, 1e-6, 1e-3, 1e-6}, Case{0.4, 0.75 * pi, 0, 500, 1e-6, 1e-3, 1e-6},
        Case{0.02, pi, 0.002, 0, 0.001, 1, 1}, Case{0.15, 2 * pi / 3, 0.005, 0, 0.007, 1, 1},
        Case{0.3, 2 * pi / 3, 0.005, 0, 0.007, 1, 1}, Case{0.15, 2 * pi, 0.01, 0, 0.002, 1, 1}})
    for (int round = 0; round < 20; ++round) {
      SCOPED_TRACE(testing::Message() << c.radius << " m over " << c.span << " rad, round " << round);
      Eigen::Isometry3d pose = test::random_pose(rng);
      pose.translation() += c.far * Eigen::Vector3d(1, -1, 1);
      Lateral lateral;
      lateral.radius = c.radius;
      lateral.span = c.span;
      lateral.noise = c.noise;
      CylinderShape shape = rough(pose, c.radius, rng);
      ASSERT_TRUE(refine(shape, lateral.samples(pose, rng)));
      EXPECT_NEAR(shape.radius, c.radius, c.largest_error);
      EXPECT_LT(tilt_deg(shape, pose), c.largest_tilt_deg);
      EXPECT_LT(off_axis(shape, pose), c.largest_off_axis);
    }
}

TEST(CylinderFit, WeighsBySigma) {
  // Half of the points lie 2 cm too far out, but say that they do not know better.
  std::mt19937_64 rng(test::seed());
  const Eigen::Isometry3d pose = test::random_pose(rng);
  Lateral exact, off;
  off.radius = exact.radius + 0.02;
  auto samples = exact.samples(pose, rng);
  for (CylinderSample s : off.samples(pose, rng)) {
    s.sigma = 100 * samples.front().sigma;
    samples.push_back(s);
  }
  CylinderShape shape = rough(pose, exact.radius, rng);
  ASSERT_TRUE(refine(shape, samples));
  EXPECT_NEAR(shape.radius, exact.radius, 1e-4);
  samples.resize(4);
  EXPECT_FALSE(refine(shape, samples)) << "four points have no one cylinder";
}

TEST(CylinderFit, ExtentIsWhereThePointsAre) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<double> angle(0, 2 * pi), spans(0.3, 6.1);
  for (int round = 0; round < 30; ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    Lateral lateral;
    lateral.from = angle(rng);
    lateral.span = spans(rng);
    lateral.points = 20000;  // so that the random gaps are small
    const auto samples = lateral.samples(pose, rng);
    const CylinderShape shape{pose * Eigen::Vector3d(0, 0, 0.3), pose.linear().col(2), lateral.radius};
    const CylinderExtent extent = extent_of(shape, samples);
    EXPECT_NEAR(extent.span, lateral.span, 0.01);
    EXPECT_NEAR(extent.low, -0.8, 0.005);
    EXPECT_NEAR(extent.high, 0.2, 0.005);
    const Eigen::Vector3d start(std::cos(lateral.from), std::sin(lateral.from), 0);
    EXPECT_LT((extent.start - pose.linear() * start).norm(), 0.01) << "counter-clockwise from there";
    EXPECT_NEAR(extent.start.dot(shape.axis), 0, 1e-9);
  }
}

/// A prism's sides: `sides` planes of equal width, `width` m wide, meeting at equal angles.
std::vector<CylinderSample> prism(int sides, int seen, double width, double noise, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> gauss(0, noise);
  const double apothem = width / 2 / std::tan(pi / sides);
  std::vector<CylinderSample> all;
  for (int i = 0; i < 600; ++i) {
    const double a = 2 * pi * (i % seen) / sides, t = width * (unit(rng) - 0.5), z = unit(rng) - 0.5;
    const Eigen::Vector3d n(std::cos(a), std::sin(a), 0), along(-std::sin(a), std::cos(a), 0);
    all.push_back({(apothem + gauss(rng)) * n + t * along + Eigen::Vector3d(0, 0, z), noise});
  }
  return all;
}

TEST(CylinderFit, FlatSidesExplainPostsBetter) {
  std::mt19937_64 rng(test::seed());
  for (const auto& [sides, seen] : {std::pair{4, 2}, {4, 4}, {4, 3}})
    for (const double width : {0.05, 0.1, 0.3}) {
      const auto samples = prism(sides, seen, width, 0.002, rng);
      CylinderShape shape{{0.01, 0, 0}, {0, 0, 1}, 0.6 * width};
      ASSERT_TRUE(refine(shape, samples));
      EXPECT_LT(weigh(shape, samples).facets, 1) << seen << " of " << sides << " sides of " << width;
    }
  for (const double span : {pi / 2, pi, 2 * pi})
    for (const double radius : {0.03, 0.1, 0.3}) {
      Lateral lateral;
      lateral.radius = radius;
      lateral.span = span;
      lateral.noise = 0.002;
      lateral.points = 600;
      const auto samples = lateral.samples(Eigen::Isometry3d::Identity(), rng);
      const CylinderShape shape{{0, 0, 0}, {0, 0, 1}, radius};
      // A quarter arc's two halves rise by r(1 − cos 22.5°): far above the noise only from r = 0.1 on.
      if (radius > 0.05 || span > 3) {
        EXPECT_GT(weigh(shape, samples).facets, 1.25) << span << " rad of " << radius;
      }
    }
}

TEST(CylinderFit, SpheresAndConesAreNotStraight) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<CylinderSample> ball, cone;
  constexpr double ball_radius = 0.15;
  for (int i = 0; i < 500; ++i) {
    const double a = pi / 2 * unit(rng), up = 0.45 * unit(rng), z = unit(rng);
    const Eigen::Vector3d n(std::cos(a) * std::cos(up), std::sin(a) * std::cos(up), std::sin(up));
    ball.push_back({ball_radius * n, 0.002});
    const double r = 0.15 - 0.05 * z;  // over 2 m
    cone.push_back({{r * std::cos(a), r * std::sin(a), z}, 0.002});
  }
  CylinderShape shape{{0, 0, 0}, {0, 0, 1}, 0.14};
  ASSERT_TRUE(refine(shape, ball));
  const CylinderEvidence of_ball = weigh(shape, ball);
  EXPECT_NEAR(of_ball.bulge, ball_radius * (1 - std::cos(0.45)), 0.003);
  shape = {{0, 0, 0}, {0, 0, 1}, 0.15};
  EXPECT_NEAR(weigh(shape, cone).taper, 0.05, 0.002);
}

// How sure a surface says its plane is, against how much planes through many noisy draws really scatter.

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
  const Eigen::Matrix3d of_line =
      covariance_over(std::array{ReadingGroup{line, 100}}, Eigen::Matrix3d::Identity());
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
