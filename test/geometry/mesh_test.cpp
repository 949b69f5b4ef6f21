#include "geometry/triangulate.hpp"
#include "planning/shapes.hpp"
#include "support/polygons.hpp"

namespace octosurf::geometry {
namespace {

using namespace shapes;

Eigen::Isometry3d tilted_frame() { return pose({1, -2, 0.5}, 0.7, {3, -5, 1.5}); }

double triangle_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x()) / 2;
}

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

void expect_valid(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> vertices;
  const Triangles triangles = triangulate(polygon, vertices);
  double area = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  for (const auto& t : triangles) {
    const double part = triangle_area(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
    EXPECT_GT(part, 0);
    area += part;
    for (std::size_t i = 0; i < 3; ++i) ++directed[{t[i], t[(i + 1) % 3]}];
  }
  EXPECT_NEAR(area, test::area(polygon), 1e-12 * (1 + area));

  // The boundary, as points: exactly the rings' directed edges.
  using Key = std::array<double, 4>;
  std::multiset<Key> boundary, rings;
  for (const auto& [edge, count] : directed) {
    EXPECT_EQ(count, 1);
    if (directed.count({edge.second, edge.first}) > 0) continue;
    const Eigen::Vector2d &a = vertices[edge.first], &b = vertices[edge.second];
    boundary.insert({a.x(), a.y(), b.x(), b.y()});
  }
  const auto add = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      rings.insert({a.x(), a.y(), b.x(), b.y()});
    }
  };
  add(polygon.outer);
  for (const Ring2& hole : polygon.holes) add(hole);
  EXPECT_EQ(boundary, rings);
}

// Each directed edge once and its opposite once: closed, manifold in its edges, one orientation. The
// triangles around every vertex form a single fan.
void expect_solid(const Mesh& mesh, double volume) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  double six_volumes = 0;
  const Eigen::Vector3d origin = mesh.vertices.front();  // near, for accuracy
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++directed[{t[i], t[(i + 1) % 3]}];
    const Eigen::Vector3d a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin;
    six_volumes += a.dot(b.cross(mesh.vertices[t[2]] - origin));
  }
  for (const auto& [edge, count] : directed) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(directed.count({edge.second, edge.first}), 1u);
  }
  EXPECT_NEAR(six_volumes / 6, volume, 1e-10 * (1 + volume));
  std::vector<std::map<std::uint32_t, std::uint32_t>> next(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) next[t[i]][t[(i + 1) % 3]] = t[(i + 2) % 3];
  }
  for (const auto& fan : next) {
    ASSERT_FALSE(fan.empty());  // no vertex without a triangle
    std::size_t steps = 0;
    std::uint32_t at = fan.begin()->first;
    do {
      at = fan.at(at);
      ++steps;
    } while (at != fan.begin()->first && steps <= fan.size());
    ASSERT_EQ(steps, fan.size());
  }
}

TEST(Mesh, TrianglesCoverTheirPolygonsAndSolidsAreClosed) {
  const Ring2 square{{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  // One hole touches the outer ring in (0, 0), the second the first in (2, 2), the other polygon both in (4,
  // 4).
  std::vector<std::vector<Polygon>> all{
      {{square, {reversed({{0, 0}, {2, 1}, {2, 2}, {1, 2}}), reversed({{2, 2}, {3, 2}, {3, 3}})}},
       {box(4, 4, 1, 1), {}}},
      {{{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, {}}}};  // collinear
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 200; ++i) all.push_back({random_polygon(random)});
  for (const std::vector<Polygon>& polygons : all) {
    std::for_each(polygons.begin(), polygons.end(), expect_valid);
    const Surface on = surface(1, polygons, tilted_frame());
    expect_solid(extrude(on, 0.05), 0.05 * on.area_m2);
    if (HasFailure()) break;
  }
}

TEST(Mesh, ASolidLiesBehindItsSurface) {
  const Mesh mesh = extrude(surface(1, {{box(0, 0, 2, 1), {}}}), 0.1);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_TRUE(v.z() == 0 || v.z() == -0.1);
}

TEST(Mesh, WhatIsNoPolygonHasNoTriangles) {
  std::vector<Eigen::Vector2d> vertices{{1, 1}};
  for (const Ring2& ring :
       {Ring2{}, Ring2{{0, 0}, {1, 1}}, Ring2{{0, 0}, {1, 1}, {2, 2}}, Ring2{{1, 1}, {1, 1}, {1, 1}}})
    EXPECT_TRUE(triangulate({ring, {}}, vertices).empty());
  EXPECT_TRUE(extrude(Surface{}, 0.02).vertices.empty());
  double area = 0;  // of a bow tie, which is cut and not refused
  for (const auto& t : triangulate({{{0, 0}, {2, 2}, {2, 0}, {0, 2}}, {}}, vertices))
    area += triangle_area(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  EXPECT_NEAR(area, 2, 1e-12);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(triangulate({{{0, 0}, {1, 0}, {nan, 1}}, {}}, vertices), Error);
  for (const double thickness : {0.0, -0.02, nan})
    EXPECT_THROW(extrude(surface(1, {{box(0, 0, 1, 1), {}}}, tilted_frame()), thickness), Error);
}

}  // namespace
}  // namespace octosurf::geometry
