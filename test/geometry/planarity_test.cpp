// Planarity by itself: patches whose scatter and bend follow from their geometry, and a slow twin.
#include "geometry/planarity.hpp"

#include "support/seed.hpp"
#include "surfaces/blobs.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <vector>

namespace octosurf::geometry {
namespace {

struct Reading {
  Eigen::Vector3d at;  // in the patch's frame, z off its plane
  double sigma = 0.005, tolerance = 0.015;
  bool inner = true;
};
using Patch = std::vector<Reading>;

Planarity gathered(const Patch& patch, const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  Planarity planarity(pose);
  for (const Reading& r : patch) planarity.add((pose * r.at).cast<float>(), r.sigma, r.tolerance, r.inner);
  return planarity;
}

/// A sheet of 21 × 21 readings whose uniform spread is `length` along the first axis and `width` along the
/// second, of height z(u, v).
template <class Height>
Patch sheet(double length, double width, const Height& height, double tolerance = 0.015) {
  constexpr int n = 21;
  const double per_step = 1 / std::sqrt(n * n - 1.0);  // n steps of 1 have variance (n² − 1)/12
  Patch patch;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double u = (i - n / 2) * length * per_step, v = (k - n / 2) * width * per_step;
      patch.push_back({{u, v, height(u, v)}, 0.005, tolerance, true});
    }
  return patch;
}

/// Bent about the second axis with that radius.
Patch arched(double length, double radius, double tolerance = 0.015) {
  return sheet(
      length, length, [&](double u, double) { return u * u / (2 * radius); }, tolerance);
}

TEST(Planarity, ScatterIsTheRootMeanSquareInSigmas) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Isometry3d pose = test::random_pose(rng);
    Patch patch;
    double squares = 0, tolerances = 0;
    for (int i = 0; i < 100; ++i) {
      const double sigma = 0.005 * (1.1 + uniform(rng)), off = 3 * uniform(rng);
      patch.push_back(
          {{uniform(rng), uniform(rng), off * sigma}, sigma, 0.02 + 0.01 * uniform(rng), i % 3 == 0});
      squares += off * off;
      tolerances += patch.back().tolerance;
    }
    const Planarity planarity = gathered(patch, pose);
    // Positions are floats: 5 m off the origin 0.0005 mm, a thousandth of the smallest σ.
    EXPECT_NEAR(planarity.scatter(), std::sqrt(squares / 100), 1e-3);
    EXPECT_NEAR(planarity.mean_tolerance(), tolerances / 100, 1e-12);
  }
}

TEST(Planarity, NothingIsFlat) {
  const Planarity planarity(Eigen::Isometry3d::Identity());
  EXPECT_EQ(planarity.scatter(), 0);
  EXPECT_FALSE(planarity.bends());
}

TEST(Planarity, NoiseDoesNotBend) {
  // The curvature fitted to n = 441 readings of σ = 5 mm over L = 0.5 m errs by 2σ/(√n·0.0745·L²) = 0.026
  // 1/m, a thirty-eighth of what bends.
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> gauss(0, 0.005);
  for (int round = 0; round < 10; ++round) {
    const Patch patch = sheet(0.5, 0.5, [&](double u, double v) { return 0.02 * u - 0.01 * v + gauss(rng); });
    EXPECT_FALSE(gathered(patch, test::random_pose(rng)).bends());
  }
}

// The three conditions, each just on either side of its limit while the others hold with room to spare.
TEST(Planarity, BendsWithARadiusBelowAMetre) {
  EXPECT_TRUE(gathered(arched(0.5, 0.98)).bends());
  EXPECT_FALSE(gathered(arched(0.5, 1.02)).bends());
}

TEST(Planarity, BendsIfItTurnsByMoreThan17Degrees) {
  EXPECT_TRUE(gathered(arched(0.2 * 0.305, 0.2, 0.005)).bends());
  EXPECT_FALSE(gathered(arched(0.2 * 0.295, 0.2, 0.005)).bends());
}

TEST(Planarity, BendsIfItBulgesByMoreThanFourTenthsOfTheTolerance) {
  // An arch of 0.18 m with a radius of 0.5 m rises by L²/8R = 8.1 mm.
  EXPECT_TRUE(gathered(arched(0.18, 0.5, 0.0080 / 0.4)).bends());
  EXPECT_FALSE(gathered(arched(0.18, 0.5, 0.0082 / 0.4)).bends());
  // Of the largest tolerances no more than 25 mm counts: 0.4 of it are the same 10 mm.
  EXPECT_TRUE(gathered(arched(0.201, 0.5, 0.2)).bends());
  EXPECT_FALSE(gathered(arched(0.199, 0.5, 0.2)).bends());
}

TEST(Planarity, BendsEitherWayAndInAnyDirection) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  for (int round = 0; round < 20; ++round) {
    const double a = angle(rng);
    const auto along = [&](double u, double v) { return std::cos(a) * u + std::sin(a) * v; };
    const auto across = [&](double u, double v) { return std::cos(a) * v - std::sin(a) * u; };
    const Eigen::Isometry3d pose = test::random_pose(rng);
    const double sign = round % 2 == 0 ? 1 : -1;
    const auto arch = [&](double u, double v) { return sign * std::pow(along(u, v), 2); };
    EXPECT_TRUE(gathered(sheet(0.4, 0.4, arch), pose).bends()) << "radius 0.5 m, at " << a;
    const auto saddle = [&](double u, double v) {
      return std::pow(along(u, v), 2) - std::pow(across(u, v), 2);
    };
    EXPECT_TRUE(gathered(sheet(0.4, 0.4, saddle), pose).bends()) << "up one way and down the other, at " << a;
    const auto gentle = [&](double u, double v) { return sign * std::pow(along(u, v), 2) / 2.2; };
    EXPECT_FALSE(gathered(sheet(0.4, 0.4, gentle), pose).bends()) << "radius 1.1 m, at " << a;
  }
}

TEST(Planarity, ALongStripBendsAlongItselfOnly) {
  // Radius 0.5 m: along 0.4 m that is a bulge of 40 mm, across 0.06 m one of 1 mm.
  EXPECT_TRUE(gathered(sheet(0.4, 0.06, [](double u, double) { return u * u; })).bends());
  EXPECT_FALSE(gathered(sheet(0.4, 0.06, [](double, double v) { return v * v; })).bends());
}

TEST(Planarity, TheRimHasNoSay) {
  // A flat patch with the foot of the wall beside it on two sides.
  Patch patch = sheet(0.4, 0.4, [](double, double) { return 0.0; });
  const Patch inside = patch;
  for (int i = 0; i < 40; ++i)
    for (const double side : {-0.21, 0.21})
      patch.push_back({{side, -0.2 + 0.01 * i, 0.1}, 0.005, 0.015, false});
  EXPECT_FALSE(gathered(patch).bends());
  EXPECT_NEAR(gathered(patch).scatter(), 20 * std::sqrt(80.0 / static_cast<double>(patch.size())), 1e-3)
      << "but it scatters";
  for (Reading& r : patch) r.inner = true;
  EXPECT_TRUE(gathered(patch).bends());
  EXPECT_FALSE(gathered(inside).bends());
}

TEST(Planarity, ElevenReadingsTellNothing) {
  Patch patch;
  for (int i = 0; i < 12; ++i) {
    const double u = 0.1 * (i % 4), v = 0.1 * (i / 4);
    patch.push_back({{u, v, 2 * u * u}, 0.005, 0.015, true});
  }
  EXPECT_TRUE(gathered(patch).bends());
  patch.pop_back();
  EXPECT_FALSE(gathered(patch).bends());
}

/// The slow twin: a quadric by least squares of all readings at once, by orthogonal factors.
bool bends_slowly(const Patch& patch, double& nearest_limit) {
  std::vector<const Reading*> inner;
  double tolerance = 0;
  for (const Reading& r : patch) {
    if (r.inner) inner.push_back(&r);
    tolerance += r.tolerance / static_cast<double>(patch.size());
  }
  const auto n = static_cast<Eigen::Index>(inner.size());
  Eigen::MatrixXd design(n, 6), uv(n, 2);
  Eigen::VectorXd heights(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d& p = inner[static_cast<std::size_t>(i)]->at;
    design.row(i) << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
    heights[i] = p.z();
    uv.row(i) = p.head<2>();
  }
  const Eigen::VectorXd c = design.colPivHouseholderQr().solve(heights);
  const Eigen::MatrixXd centred = uv.rowwise() - uv.colwise().mean();
  // Curvature along a direction is largest and smallest at two angles, which half of the arctangent gives.
  const double first = std::atan2(c[4], c[3] - c[5]) / 2;
  bool bends = false;
  nearest_limit = 1e9;
  for (const double a : {first, first + std::numbers::pi / 2}) {
    const double x = std::cos(a), y = std::sin(a);
    const double curvature = std::fabs(2 * (c[3] * x * x + c[4] * x * y + c[5] * y * y));
    const double length =
        std::sqrt(12 * (centred * Eigen::Vector2d(x, y)).squaredNorm() / static_cast<double>(n));
    const double over = std::min({curvature / 1, curvature * length / 0.3,
                                  curvature * length * length / 8 / (0.4 * std::min(tolerance, 0.025))});
    nearest_limit = std::min(nearest_limit, std::fabs(over - 1));
    bends = bends || over > 1;
  }
  return bends;
}

TEST(Planarity, AgreesWithTheSlowTwin) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> gauss(0, 0.004);
  int bent = 0, compared = 0;
  for (int round = 0; round < 200; ++round) {
    Eigen::Matrix<double, 6, 1> c;
    for (int k = 0; k < 6; ++k)
      c[k] = uniform(rng) * (k == 0 ? 0.02 : k < 3 ? 0.2 : round % 2 == 0 ? 1.2 : 0.1);
    const double length = 0.3 + 0.25 * uniform(rng), width = 0.3 + 0.25 * uniform(rng);
    Patch patch;
    const int readings = 20 + static_cast<int>(rng() % 300);
    for (int i = 0; i < readings; ++i) {
      const double u = length * uniform(rng), v = width * uniform(rng);
      const double z = c[0] + c[1] * u + c[2] * v + c[3] * u * u + c[4] * u * v + c[5] * v * v;
      patch.push_back({{u, v, z + gauss(rng)}, 0.005, 0.02 + 0.01 * uniform(rng), rng() % 5 != 0});
    }
    double nearest_limit = 0;
    const bool expected = bends_slowly(patch, nearest_limit);
    if (nearest_limit < 1e-3) continue;  // positions are floats
    ++compared;
    bent += expected;
    EXPECT_EQ(gathered(patch, test::random_pose(rng)).bends(), expected) << "round " << round;
  }
  EXPECT_GT(compared, 150);
  EXPECT_GT(bent, 20);
  EXPECT_GT(compared - bent, 20);
}

}  // namespace
}  // namespace octosurf::geometry
