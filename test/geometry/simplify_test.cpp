#include "geometry/simplify.hpp"

#include "geometry/rings.hpp"
#include "support/alpha_shape_twin.hpp"
#include "support/polygons.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::geometry {
namespace {

std::vector<Ring2> rings_of(const std::vector<Polygon>& polygons) {
  std::vector<Ring2> rings;
  for (const Polygon& polygon : polygons) {
    rings.push_back(polygon.outer);
    rings.insert(rings.end(), polygon.holes.begin(), polygon.holes.end());
  }
  return rings;
}

double distance(const Eigen::Vector2d& p, const Ring2& ring) {
  return test::distance_to_rings(p, {Polygon{ring, {}}});
}

void expect_simplified(const std::vector<Polygon>& polygons, double tolerance) {
  const std::vector<Polygon> simple = simplify(polygons, tolerance);
  EXPECT_EQ(test::invalid(simple), "");
  ASSERT_EQ(simple.size(), polygons.size());
  for (std::size_t i = 0; i < simple.size(); ++i) ASSERT_EQ(simple[i].holes.size(), polygons[i].holes.size());
  const std::vector<Ring2> before = rings_of(polygons), after = rings_of(simple);
  for (std::size_t r = 0; r < before.size(); ++r) {
    EXPECT_LE(after[r].size(), before[r].size());
    EXPECT_EQ(signed_area(after[r]) > 0, signed_area(before[r]) > 0);
    std::set<std::pair<double, double>> vertices;
    for (const Eigen::Vector2d& p : before[r]) {
      vertices.emplace(p.x(), p.y());
      EXPECT_LE(distance(p, after[r]), tolerance * (1 + 1e-9)) << "the outline has moved too far";
    }
    for (const Eigen::Vector2d& p : after[r])
      EXPECT_TRUE(vertices.contains({p.x(), p.y()})) << "a new vertex";
  }
}

TEST(Simplify, StaysWithinToleranceAndKeepsTopology) {
  std::mt19937_64 rng = test::rng();
  for (int round = 0; round < 12 && !HasFailure(); ++round) {
    const test::Blob blob = test::random_blob(rng, 0.6, 0.08);
    std::vector<Eigen::Vector2d> points;
    for (const surfaces::Inlier& i :
         test::voxels_of(blob, Eigen::Isometry3d::Identity(), 0.02, 0.6, 0.001, rng))
      points.push_back(i.position.head<2>().cast<double>());
    const std::vector<Polygon> polygons = alpha_shape(points, 0.08);
    ASSERT_FALSE(polygons.empty());
    for (const double tolerance : {0.0, 0.005, 0.01, 0.03}) expect_simplified(polygons, tolerance);
  }
  // Random points and a small alpha: rings that touch each other in vertices.
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 30 && !HasFailure(); ++round) {
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < 250; ++i) points.emplace_back(uniform(rng), uniform(rng));
    expect_simplified(alpha_shape(points, 0.1), 0.02);
  }
}

TEST(Simplify, DropsWhatIsCollinear) {
  Ring2 square;
  const Ring2 corners{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::size_t k = 0; k < 4; ++k)
    for (int i = 0; i < 10; ++i) square.push_back(corners[k] + 0.1 * i * (corners[(k + 1) % 4] - corners[k]));
  const auto simple = simplify({Polygon{square, {}}}, 0.001);
  ASSERT_EQ(simple.size(), 1U);
  // A ring's first vertex may stay wherever it is.
  EXPECT_LE(simple[0].outer.size(), 5U);
  EXPECT_NEAR(signed_area(simple[0].outer), 1, 1e-9);
}

}  // namespace
}  // namespace octosurf::geometry
