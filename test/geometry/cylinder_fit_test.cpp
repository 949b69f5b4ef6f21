#include "geometry/cylinder_fit.hpp"

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

}  // namespace
}  // namespace octosurf::geometry
