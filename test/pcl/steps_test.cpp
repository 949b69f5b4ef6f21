// What PCL's parts give, against what the paper says of them, by brute force.
#include "pcl/steps.hpp"

#include "support/testing.hpp"

namespace octosurf::pcl {
namespace {

using ::testing::ElementsAreArray;

/// Near the plane z = 0.1 x, and a tenth anywhere in the cube about it.
Points tilted_plane(std::mt19937_64& random, std::size_t count) {
  std::uniform_real_distribution<float> place(-0.5F, 0.5F);
  std::normal_distribution<float> error(0, 0.002F);
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = place(random), y = place(random);
    points.emplace_back(x, y, i % 10 == 0 ? place(random) : 0.1F * x + error(random));
  }
  return points;
}

TEST(Steps, KeepsThePointsWithTwoNeighbours) {
  auto random = test::rng();
  const Points points = tilted_plane(random, 300);
  constexpr double radius = 0.05;
  Indices expected;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto others = std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3f& p) {
      return (p - points[i]).cast<double>().norm() <= radius;
    });
    if (others > 2) expected.push_back(i);  // itself among them
  }
  EXPECT_LT(expected.size(), points.size());
  EXPECT_THAT(with_neighbors(points, radius, 2), ElementsAreArray(expected));
}

TEST(Steps, FindsThePlaneWithAllThatLiesWithinS) {
  auto random = test::rng();
  const Points points = tilted_plane(random, 500);
  const PlaneFit fit = fit_plane(points, 0.01);
  EXPECT_GT(fit.inliers.size(), 440U);  // of 450, and some of the others
  const double cosine = std::fabs(fit.plane.normal.dot(Eigen::Vector3d(-0.1, 0, 1).normalized()));
  EXPECT_GT(cosine, std::cos(2 * std::numbers::pi / 180));
  for (const std::uint32_t i : fit.inliers)
    EXPECT_LE(std::fabs(fit.plane.signed_distance(points[i].cast<double>())), 0.01 + 1e-6);
}

TEST(Steps, SplitsWhatLiesFartherApartThanH) {
  Points points;
  for (int k = 0; k < 30; ++k)
    points.emplace_back(0.05F * static_cast<float>(k) + (k < 18 ? 0 : 0.1F), 0.F, 0.F);
  const std::vector<Indices> pieces = clusters(points, 0.08);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_EQ(std::set<std::size_t>({pieces[0].size(), pieces[1].size()}), std::set<std::size_t>({18, 12}));
}

/// A strip has far more than 30 points nearer than the next strip.
TEST(Steps, GrowsOverAllNeighboursWithinR) {
  Points strips;
  for (int strip = 0; strip < 3; ++strip)
    for (int i = 0; i < 40; ++i)
      for (int k = 0; k < 5; ++k)
        strips.emplace_back(0.1F * static_cast<float>(strip) + 0.005F * static_cast<float>(k),
                            0.005F * static_cast<float>(i), 0.F);
  std::vector<PointNormal> normals;
  for (std::uint32_t i = 0; i < strips.size(); ++i) normals.push_back({i, Eigen::Vector3f::UnitZ(), 0});
  EXPECT_EQ(smooth_regions(strips, normals, 0.09).size(), 1U);
  EXPECT_EQ(smooth_regions(strips, normals, 0.07).size(), 3U);
}

TEST(Steps, NormalsAreThoseOfThePlaneThatPointsLieOn) {
  auto random = test::rng();
  const Points points = tilted_plane(random, 900);
  std::size_t near = 0, all = 0;
  for (const PointNormal& normal : mls_normals(points, 0.15)) {
    if (normal.point % 10 == 0) continue;  // off it
    ++all;
    near += std::fabs(normal.normal.dot(Eigen::Vector3f(-0.1F, 0, 1).normalized())) > 0.9F;
  }
  EXPECT_GT(all, 700U);
  EXPECT_GT(near, 0.9 * static_cast<double>(all));
}

TEST(Steps, FitsThatFailAreSilent) {
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(fit_plane(Points(20, Eigen::Vector3f::Zero()), 0.01).inliers.empty());
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace octosurf::pcl
