// The width of points where they lie: strips, lattices and blobs whose width is known, and a slow twin.
#include "geometry/local_width.hpp"

#include "geometry/plane_frame.hpp"
#include "support/testing.hpp"

namespace octosurf::geometry {
namespace {

using Points = std::vector<Eigen::Vector2d>;

/// One point somewhere in each square of a grid of `spacing` that has one in the shape, as an octree has it.
template <class Holds>
Points points_in(double reach, double spacing, std::mt19937_64& rng, Holds&& holds) {
  std::uniform_real_distribution<double> within(0, spacing);
  Points points;
  for (double u = -reach; u < reach; u += spacing)
    for (double v = -reach; v < reach; v += spacing)
      if (const Eigen::Vector2d p(u + within(rng), v + within(rng)); holds(p)) points.push_back(p);
  return points;
}

void turn(Points& points, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> any(-50, 50);
  const Eigen::Rotation2Dd R(any(rng));
  const Eigen::Vector2d t(any(rng), any(rng));
  for (Eigen::Vector2d& p : points) p = R * p + t;
}

/// By all pairs of points.
std::optional<double> slow_median_width(const Points& points, double width, double spacing) {
  std::vector<double> widths;
  for (const Eigen::Vector2d& at : points) {
    Moments around;
    for (const Eigen::Vector2d& p : points)
      if ((p - at).norm() <= 1.5 * width) around.add({p.x() - at.x(), p.y() - at.y(), 0});
    const double w = width_of(around);
    widths.push_back(w > spacing ? w : 1e9);
  }
  std::sort(widths.begin(), widths.end());
  if (widths[widths.size() / 2] == 1e9) return {};
  return std::hypot(widths[widths.size() / 2], spacing);  // of readings: points are their means over cells
}

TEST(LocalWidth, IsAStripsWidth) {
  std::mt19937_64 rng = test::rng();
  for (const double width : {0.02, 0.025, 0.03, 0.04}) {
    Points strip = points_in(0.5, 0.002, rng, [&](const auto& p) { return std::abs(p.y()) < width / 2; });
    turn(strip, rng);
    // Of the nearest 4.5 cm, 500 points: their variance is known to a fifteenth, their width to a thirtieth.
    const std::optional<double> found = median_local_width(strip, 0.03, 0.002);
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, width, 0.05 * width);
  }
}

TEST(LocalWidth, LinesOfReadingsAreNoMeasure) {
  Points lines;
  for (int line = 0; line < 10; ++line)
    for (int k = 0; k < 200; ++k) lines.emplace_back(0.005 * k, 0.06 * line + (k % 2) * 0.004);
  EXPECT_FALSE(median_local_width(lines, 0.03, 0.01));
  EXPECT_FALSE(median_local_width(Points{{1, 2}}, 0.03, 0.01));
  EXPECT_FALSE(median_local_width(Points{}, 0.03, 0.01));
  const Points strip{{0, 0}, {0, 0.02}, {0.02, 0}, {0.02, 0.02}};
  EXPECT_TRUE(median_local_width(strip, 0.03, 0.01));
  EXPECT_FALSE(median_local_width(strip, 0.03, 0.03)) << "points no closer than the width";
}

TEST(LocalWidth, ALineThatBendsHasNone) {
  Points ring, corner;
  for (int k = 0; k < 40; ++k) ring.emplace_back(1.3 * std::cos(0.03 * k), 1.3 * std::sin(0.03 * k));
  for (int k = -10; k <= 10; ++k) corner.emplace_back(0.04 * k, 0.016 * std::abs(k));
  for (Points line : {ring, corner}) {
    EXPECT_TRUE(median_local_width(line, 0.4, 0.05)) << "in a disc";
    EXPECT_FALSE(median_local_width(line, 0.4, 0.05, 400, {}, 0.05));
    const std::size_t size = line.size();
    for (std::size_t k = 0; k < size; ++k) line.push_back(line[k] + Eigen::Vector2d(0.25, 0.25));
    EXPECT_TRUE(median_local_width(line, 0.4, 0.05, 400, {}, 0.05)) << "beside another one";
  }
}

TEST(LocalWidth, WhatNoiseSpreadsIsNone) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> off(-0.04, 0.04);
  Points line;
  for (int k = 0; k < 300; ++k) line.emplace_back(0.005 * k, off(rng));
  EXPECT_TRUE(median_local_width(line, 0.2, 0.05));
  EXPECT_FALSE(median_local_width(line, 0.2, 0.05, 400, Points(line.size(), {0, 0.04})));
  EXPECT_TRUE(median_local_width(line, 0.2, 0.05, 400, Points(line.size(), {0.04, 0})));
}

TEST(LocalWidth, IsTheSlowTwins) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> place(-0.3, 0.3), radius(0.005, 0.08);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Vector2d a(place(rng), place(rng)), b(place(rng), place(rng)), c(place(rng), place(rng));
    const double r = radius(rng), s = radius(rng), t = radius(rng);
    Points blob = points_in(0.35, 0.012, rng, [&](const Eigen::Vector2d& p) {
      return (p - a).norm() < r || std::abs(p.x() - b.x()) < s / 2 || (p - c).norm() < t;
    });
    turn(blob, rng);
    const std::optional<double> fast = median_local_width(blob, 0.04, 0.012, blob.size()),
                                slow = slow_median_width(blob, 0.04, 0.012);
    ASSERT_EQ(fast.has_value(), slow.has_value());
    EXPECT_NEAR(fast.value_or(0), slow.value_or(0), 1e-6);
  }
}

}  // namespace
}  // namespace octosurf::geometry
