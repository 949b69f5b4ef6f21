// The alpha shape against a Delaunay triangulation by definition: circumcircles without points.
#include "geometry/rings.hpp"
#include "support/alpha_shape_twin.hpp"
#include "support/polygons.hpp"
#include "support/testing.hpp"

namespace octosurf::geometry {
namespace {

using Points = std::vector<Eigen::Vector2d>;

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

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

void expect_alpha_shape(const Points& points, double alpha) {
  const std::vector<Polygon> polygons = alpha_shape(points, alpha);
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
  EXPECT_NEAR(test::area(polygons), area, 1e-9);
  EXPECT_EQ(polygons.size(), components(inside));
}

TEST(AlphaShape, EqualsDelaunayByDefinition) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 60 && !HasFailure(); ++round) {
    Points points;
    const auto n = static_cast<int>(rng() % 72);
    for (int i = 0; i < n; ++i) points.emplace_back(uniform(rng), uniform(rng));
    // From almost nothing to almost the convex hull: bridges, pinched rings, holes, islands.
    for (const double alpha : {0.1, 0.15, 0.2, 0.25, 0.4, 2.0}) expect_alpha_shape(points, alpha);
  }
}

}  // namespace
}  // namespace octosurf::geometry
