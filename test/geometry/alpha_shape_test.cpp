// The alpha shape against a Delaunay triangulation by definition: circumcircles without points.
#include "geometry/rings.hpp"
#include "support/alpha_shape_twin.hpp"
#include "support/polygons.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"

#include <gtest/gtest.h>
#include <map>
#include <numeric>
#include <random>

namespace octosurf::geometry {
namespace {

using Points = std::vector<Eigen::Vector2d>;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double total_area(const std::vector<Polygon>& polygons) {
  double area = 0;
  for (const Polygon& p : polygons) area += area_of(p);
  return area;
}

bool in_circle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
               const Eigen::Vector2d& p) {
  Eigen::Matrix3d m;
  m << (a - p).transpose(), (a - p).squaredNorm(), (b - p).transpose(), (b - p).squaredNorm(),
      (c - p).transpose(), (c - p).squaredNorm();
  return m.determinant() > 0;
}

using Triangle = std::array<std::size_t, 3>;

/// O(n⁴); for points of which no four are cocircular.
std::vector<Triangle> delaunay_by_definition(const Points& points) {
  std::vector<Triangle> triangles;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i + 1; j < points.size(); ++j)
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        Triangle t{i, j, k};
        if (cross(points[j] - points[i], points[k] - points[i]) < 0) std::swap(t[1], t[2]);
        bool empty = true;
        for (std::size_t p = 0; p < points.size() && empty; ++p)
          empty =
              p == i || p == j || p == k || !in_circle(points[t[0]], points[t[1]], points[t[2]], points[p]);
        if (empty) triangles.push_back(t);
      }
  return triangles;
}

bool kept(const Points& points, const Triangle& t, double alpha) {
  for (std::size_t e = 0; e < 3; ++e)
    if ((points[t[e]] - points[t[(e + 1) % 3]]).norm() > alpha) return false;
  return true;
}

/// Pieces of triangles joined by edges.
std::size_t components(const std::vector<Triangle>& triangles) {
  std::vector<std::size_t> parent(triangles.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i];
    return i;
  };
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> edges;
  std::size_t count = triangles.size();
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (std::size_t e = 0; e < 3; ++e) {
      const auto edge = std::minmax(triangles[i][e], triangles[i][(e + 1) % 3]);
      const auto [other, fresh] = edges.try_emplace({edge.first, edge.second}, i);
      if (fresh || root(other->second) == root(i)) continue;
      parent[root(other->second)] = root(i);
      --count;
    }
  return count;
}

void expect_rules(const std::vector<Polygon>& polygons, double alpha) {
  EXPECT_EQ(test::invalid(polygons), "");
  for (const Polygon& polygon : polygons) {
    EXPECT_GT(signed_area(polygon.outer), 0);
    std::vector<Ring2> rings = polygon.holes;
    for (const Ring2& hole : polygon.holes) EXPECT_LT(signed_area(hole), 0);
    rings.push_back(polygon.outer);
    for (const Ring2& ring : rings)
      for (std::size_t i = 0; i < ring.size(); ++i)
        EXPECT_LE((ring[i] - ring[(i + 1) % ring.size()]).norm(), alpha * (1 + 1e-12));
  }
}

void expect_alpha_shape(const Points& points, double alpha) {
  const std::vector<Polygon> polygons = alpha_shape(points, alpha);
  expect_rules(polygons, alpha);
  const test::Region shape(polygons);
  std::vector<Triangle> inside;
  double area = 0;
  for (const Triangle& t : delaunay_by_definition(points)) {
    const Eigen::Vector2d &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
    const bool in = kept(points, t, alpha);
    if (cross(b - a, c - a) > 1e-9) {
      EXPECT_EQ(shape.covers((a + b + c) / 3), in);
    }
    if (!in) continue;
    inside.push_back(t);
    area += cross(b - a, c - a) / 2;
  }
  EXPECT_NEAR(total_area(polygons), area, 1e-9);
  EXPECT_EQ(polygons.size(), components(inside));
}

TEST(AlphaShape, EqualsDelaunayByDefinition) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 60 && !HasFailure(); ++round) {
    Points points;
    const int n = 3 + static_cast<int>(rng() % 70);
    for (int i = 0; i < n; ++i) points.emplace_back(uniform(rng), uniform(rng));
    // From almost nothing to almost the convex hull: bridges, pinched rings, holes, islands.
    for (const double alpha : {0.1, 0.15, 0.2, 0.25, 0.4, 2.0}) expect_alpha_shape(points, alpha);
  }
}

TEST(AlphaShape, FarFromTheOrigin) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  Points near, far;
  for (int i = 0; i < 400; ++i) {
    near.emplace_back(uniform(rng), uniform(rng));
    far.push_back(near.back() + Eigen::Vector2d(800, -300));
  }
  const auto a = alpha_shape(near, 0.1), b = alpha_shape(far, 0.1);
  expect_rules(b, 0.1 + 1e-9);
  EXPECT_NEAR(total_area(a), total_area(b), 1e-8);
  EXPECT_EQ(test::count_rings(a), test::count_rings(b));
}

TEST(AlphaShape, NothingFromTooLittle) {
  EXPECT_TRUE(alpha_shape({}, 1).empty());
  EXPECT_TRUE(alpha_shape(Points{{0, 0}}, 1).empty());
  EXPECT_TRUE(alpha_shape(Points{{0, 0}, {1, 0}}, 2).empty());
  EXPECT_TRUE(alpha_shape(Points{{1, 1}, {1, 1}, {1, 1}, {1, 1}}, 2).empty());
  Points line;
  for (int i = 0; i < 50; ++i) line.emplace_back(0.25 * i, 0.5 * i);
  EXPECT_TRUE(alpha_shape(line, 10).empty());
  EXPECT_TRUE(alpha_shape(Points{{0, 0}, {1, 0}, {0, 1}}, 1.4).empty()) << "the hypotenuse is longer";
  EXPECT_EQ(alpha_shape(Points{{0, 0}, {1, 0}, {0, 1}}, 1.42).size(), 1U);
}

TEST(AlphaShape, DuplicatesChangeNothing) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  Points points;
  for (int i = 0; i < 200; ++i) points.emplace_back(uniform(rng), uniform(rng));
  const auto once = alpha_shape(points, 0.12);
  const Points copy = points;
  points.insert(points.end(), copy.begin(), copy.end());
  EXPECT_EQ(test::ring_sets(alpha_shape(points, 0.12)), test::ring_sets(once));
}

TEST(AlphaShape, OrderOfPointsChangesNothing) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Points points;
  for (int i = 0; i < 500; ++i) points.emplace_back(uniform(rng), uniform(rng));
  const auto before = test::ring_sets(alpha_shape(points, 0.07));
  std::shuffle(points.begin(), points.end(), rng);
  EXPECT_EQ(test::ring_sets(alpha_shape(points, 0.07)), before);
}

Points grid(int from, int to, double step) {
  Points points;
  for (int v = from; v <= to; ++v)
    for (int u = from; u <= to; ++u) points.emplace_back(u * step, v * step);
  return points;
}

TEST(AlphaShape, CocircularGrid) {
  // A power of two, so that the grid is exactly cocircular.
  const auto polygons = alpha_shape(grid(0, 16, 0.0625), 0.1);
  expect_rules(polygons, 0.1);
  ASSERT_EQ(polygons.size(), 1U);
  EXPECT_TRUE(polygons[0].holes.empty());
  EXPECT_NEAR(total_area(polygons), 1, 1e-12);
  EXPECT_TRUE(alpha_shape(grid(0, 16, 0.0625), 0.08).empty()) << "every triangle has a diagonal";
}

TEST(AlphaShape, HoleAndIslandInIt) {
  constexpr double step = 0.0625;
  Points points;
  for (const Eigen::Vector2d& p : grid(-16, 16, step)) {
    const double r = p.cwiseAbs().maxCoeff();
    if (r >= 0.5 || r <= 0.25) points.push_back(p);
  }
  const auto polygons = alpha_shape(points, 0.1);
  expect_rules(polygons, 0.1);
  ASSERT_EQ(polygons.size(), 2U);
  const Polygon& frame = polygons[0].holes.empty() ? polygons[1] : polygons[0];
  const Polygon& island = polygons[0].holes.empty() ? polygons[0] : polygons[1];
  ASSERT_EQ(frame.holes.size(), 1U);
  // Across each corner of the hole lies half a cell, whose diagonal is below alpha.
  constexpr double hole = 1 - 4 * step * step / 2;
  EXPECT_NEAR(area_of(frame), 4 - hole, 1e-12);
  EXPECT_NEAR(signed_area(frame.holes[0]), -hole, 1e-12);
  EXPECT_NEAR(area_of(island), 0.25, 1e-12);
}

TEST(AlphaShape, RingsThatTouchInAVertex) {
  // Two triangles that share a vertex only: two polygons.
  const auto pair = alpha_shape(Points{{0, 0}, {1, 0.4}, {1, -0.4}, {-1, 0.4}, {-1, -0.4}}, 1.2);
  expect_rules(pair, 1.2);
  EXPECT_EQ(pair.size(), 2U);
  // A square of 8 × 8 cells of which three grid points are missing, so that each of the four triangles at an
  // inner one goes: a hole of two cells. The first hole touches the bite of one cell that the point missing
  // on the left side leaves, and the second hole, in a vertex each.
  constexpr double cell = 0.125;
  const auto is = [cell](const Eigen::Vector2d& p, double u, double v) {
    return (p - cell * Eigen::Vector2d(u, v)).norm() < 1e-9;
  };
  Points points;
  for (const Eigen::Vector2d& p : grid(0, 8, cell))
    if (!is(p, 0, 2) && !is(p, 2, 2) && !is(p, 4, 2)) points.push_back(p);
  const auto square = alpha_shape(points, 0.18);
  expect_rules(square, 0.18);
  ASSERT_EQ(square.size(), 1U);
  ASSERT_EQ(square[0].holes.size(), 2U);
  EXPECT_NEAR(total_area(square), (64 - 1 - 2 - 2) * cell * cell, 1e-9);
  const auto visits = [&](const Ring2& ring, double u, double v) {
    return std::count_if(ring.begin(), ring.end(), [&](const auto& p) { return is(p, u, v); });
  };
  for (const Ring2& hole : square[0].holes) {
    EXPECT_EQ(hole.size(), 4U);
    EXPECT_NEAR(signed_area(hole), -2 * cell * cell, 1e-9);
    EXPECT_EQ(visits(hole, 3, 2), 1) << "where the holes touch";
  }
  EXPECT_EQ(visits(square[0].holes[0], 1, 2) + visits(square[0].holes[1], 1, 2), 1);
  EXPECT_EQ(visits(square[0].outer, 1, 2), 1) << "where the first touches the bite";
}

}  // namespace
}  // namespace octosurf::geometry
