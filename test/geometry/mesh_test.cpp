#include "geometry/outline.hpp"
#include "geometry/ring_check.hpp"
#include "geometry/triangulate.hpp"
#include "io/files.hpp"
#include "planning/shapes.hpp"
#include "support/polygons.hpp"

namespace octosurf::geometry {
namespace {

using namespace shapes;

Eigen::Isometry3d tilted_frame() { return pose({1, -2, 0.5}, 0.7, {3, -5, 1.5}); }

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

void expect_valid(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> vertices;
  const Triangles triangles = triangulate(polygon, vertices);
  double area = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  for (const auto& t : triangles) {
    const double part = ring_area({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
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
    area += ring_area({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  EXPECT_NEAR(area, 2, 1e-12);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(triangulate({{{0, 0}, {1, 0}, {nan, 1}}, {}}, vertices), Error);
  for (const double thickness : {0.0, -0.02, nan})
    EXPECT_THROW(extrude(surface(1, {{box(0, 0, 1, 1), {}}}, tilted_frame()), thickness), Error);
}

using Point = Eigen::Vector2d;

// The obvious twin, for whole numbers: all pairs of edges, then what lies on either side of every edge.

double cross(const Point& a, const Point& b, const Point& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}
bool on(const Point& p, const Point& a, const Point& b) {
  return cross(a, b, p) == 0 && (p - a).dot(p - b) <= 0;
}
struct Edge {
  Point a, b;
};
bool only_ends_meet(const Edge& e, const Edge& f) {
  for (const auto& [p, edge, other] : {std::tuple{e.a, f, e}, {e.b, f, e}, {f.a, e, f}, {f.b, e, f}})
    if (on(p, edge.a, edge.b) && p != edge.a && p != edge.b) return false;
  if ((e.a == f.a && e.b == f.b) || (e.a == f.b && e.b == f.a)) return false;
  return !(cross(e.a, e.b, f.a) * cross(e.a, e.b, f.b) < 0 &&
           cross(f.a, f.b, e.a) * cross(f.a, f.b, e.b) < 0);
}
int winding(const Ring2& ring, const Point& p) {
  int turns = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point &a = ring[i], &b = ring[(i + 1) % ring.size()];
    if (a.y() <= p.y() && b.y() > p.y() && cross(a, b, p) > 0) ++turns;
    if (a.y() > p.y() && b.y() <= p.y() && cross(a, b, p) < 0) --turns;
  }
  return turns;
}
bool layers_fit(const std::vector<Polygon>& polygons, const Point& p) {
  int all = 0;
  for (const Polygon& polygon : polygons) {
    int own = winding(polygon.outer, p);
    for (const Ring2& hole : polygon.holes) own += winding(hole, p);
    if (own < 0 || own > 1) return false;
    all += own;
  }
  return all <= 1;
}
bool sound(const std::vector<Polygon>& polygons) {
  std::vector<Edge> edges;
  const auto add = [&](const Ring2& ring, bool outer) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      if (std::count(ring.begin(), ring.end(), ring[i]) != 1) return false;
      edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
    }
    return ring.size() >= 3 && (outer ? ring_area(ring) > 0 : ring_area(ring) < 0);
  };
  for (const Polygon& polygon : polygons) {
    if (!add(polygon.outer, true)) return false;
    for (const Ring2& hole : polygon.holes)
      if (!add(hole, false)) return false;
  }
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (!only_ends_meet(edges[i], edges[j])) return false;
  for (const Edge& e : edges) {
    const Point middle = (e.a + e.b) / 2, beside = Point(e.a.y() - e.b.y(), e.b.x() - e.a.x()) * 1e-4;
    if (!layers_fit(polygons, middle + beside) || !layers_fit(polygons, middle - beside)) return false;
  }
  return true;
}

/// Rings of three to six vertices on a small grid, in the right sense for the most part.
Ring2 random_ring(std::mt19937_64& rng, bool outer) {
  const std::size_t n = 3 + rng() % 4;
  const Point centre(static_cast<double>(rng() % 5), static_cast<double>(rng() % 5));
  std::vector<std::pair<double, Point>> places;
  for (std::size_t i = 0; i < n; ++i) {
    const Point p(static_cast<double>(rng() % 5), static_cast<double>(rng() % 5));
    places.emplace_back(std::atan2(p.y() - centre.y() - 0.1, p.x() - centre.x() - 0.2), p);
  }
  if (rng() % 8 != 0)
    std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Ring2 ring;
  for (const auto& [angle, p] : places) ring.push_back(p);
  if ((ring_area(ring) > 0) != outer && rng() % 8 != 0) std::reverse(ring.begin(), ring.end());
  return ring;
}

TEST(RingCheck, SaysWhatAllPairsOfEdgesSay) {
  std::mt19937_64 rng(test::seed());
  int good = 0, bad = 0;
  for (int round = 0; round < 60000; ++round) {
    std::vector<Polygon> polygons(1 + rng() % 2);
    for (Polygon& polygon : polygons) {
      polygon.outer = random_ring(rng, true);
      for (auto holes = rng() % 3; holes > 0; --holes) polygon.holes.push_back(random_ring(rng, false));
    }
    const bool expected = sound(polygons);
    const auto fault = fault_of(polygons);
    ASSERT_EQ(!fault.has_value(), expected) << "round " << round << ": " << fault.value_or("no fault");
    ++(expected ? good : bad);
  }
  EXPECT_GT(good, 1000) << "nothing of what this test is about happened";
  EXPECT_GT(bad, 10000);
}

/// Sites on a coarse grid: outlines that touch themselves in vertices, holes in islands in holes.
TEST(RingCheck, TakesWhateverAnOutlineGives) {
  std::mt19937_64 rng(test::seed());
  std::size_t rings = 0;
  for (int round = 0; round < 200; ++round) {
    Outline outline(1.9);
    for (int v = 0; v < 24; ++v)
      for (int u = 0; u < 24; ++u)
        if (rng() % 10 < 5 + static_cast<std::uint64_t>(round) % 4) {
          const auto shift = [&] { return 0.25 * static_cast<double>(rng() % 3); };
          const double x = u + shift(), y = v + shift();
          const std::vector<Point> site{Point(x, y)};
          outline.set({u, v}, site);
        }
    std::vector<Polygon> polygons = outline.update();
    EXPECT_EQ(fault_of(polygons), std::nullopt) << "round " << round;
    // As a surface moves them.
    const Eigen::Rotation2Dd turn(static_cast<double>(rng() % 1000));
    const auto move = [&](Ring2& ring) {
      for (Point& p : ring) p = turn * (0.02 * p) + Point(31.7, -812.3);
    };
    for (Polygon& polygon : polygons) {
      move(polygon.outer);
      std::for_each(polygon.holes.begin(), polygon.holes.end(), move);
      rings += 1 + polygon.holes.size();
    }
    EXPECT_EQ(fault_of(polygons), std::nullopt) << "round " << round << ", moved";
  }
  EXPECT_GT(rings, 5000U);
}

TEST(RingCheck, NamesTheFault) {
  const Ring2 square{{0, 0}, {4, 0}, {4, 4}, {0, 4}}, small{{1, 1}, {1, 2}, {2, 2}, {2, 1}};
  const auto backwards = [](Ring2 ring) {
    std::reverse(ring.begin(), ring.end());
    return ring;
  };
  const auto fault = [](const std::vector<Polygon>& polygons) {
    return std::string(fault_of(polygons).value_or("none"));
  };
  const auto ring_fault = [&](const Ring2& ring) { return fault({Polygon{ring, {}}}); };
  using ::testing::HasSubstr;
  EXPECT_EQ(fault({}), "none");
  EXPECT_EQ(fault({Polygon{square, {small}}}), "none");
  const Ring2 island{{1, 1}, {2, 1}, {1.5, 1.5}};
  EXPECT_THAT(fault({Polygon{square, {small}}, Polygon{island, {}}}), HasSubstr("along each other"));
  const Ring2 free_island{{1, 1}, {1.8, 1.2}, {1.5, 1.5}};
  EXPECT_EQ(fault({Polygon{square, {small}}, Polygon{free_island, {}}}), "none") << "it touches its hole";
  EXPECT_THAT(fault({Polygon{square, {}}, Polygon{free_island, {}}}), HasSubstr("in the wrong place"));
  EXPECT_THAT(fault({Polygon{square, {backwards(small)}}}), HasSubstr("wrong"));
  EXPECT_THAT(ring_fault(backwards(square)), HasSubstr("wrong way"));
  EXPECT_THAT(ring_fault({{1, 1}, {1, 1}, {1, 1}}), HasSubstr("a vertex twice"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {2, 0}}), HasSubstr("along each other"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {4, 4}, {4, 6}, {4, 4}, {0, 4}}), HasSubstr("a vertex twice"))
      << "a spike";
  EXPECT_THAT(ring_fault({{0, 0}, {4, 4}, {4, 0}, {0, 4}}), HasSubstr("cross"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {3, 4}}), HasSubstr("a vertex on an edge"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {4, 4}, {2, 0}}), HasSubstr("along each other"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}), HasSubstr("cross"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}}), HasSubstr("along each other"));
  EXPECT_THAT(ring_fault({}), HasSubstr("fewer than three"));
  EXPECT_THAT(ring_fault({{0, 0}, {4, 0}, {4, std::nan("")}}), HasSubstr("not finite"));
}

/// A caller's own polygons, with rings that are none, once went into CGAL: a crash, an exception of its own.
TEST(RingCheck, SimplifiedRefusesWhatIsNoPolygon) {
  for (const Ring2& ring : {Ring2{{1, 1}, {1, 1}, {1, 1}}, Ring2{{0, 0}, {4, 4}, {4, 0}, {0, 4}},
                            Ring2{{0, 0}, {4, 0}, {4, 4}, {4, 6}, {4, 4}, {0, 4}}})
    for (const double resolution : {0.0, 0.02}) {
      Surface surface;
      surface.id = 7;
      surface.resolution = resolution;
      surface.polygons = {Polygon{ring, {}}};
      EXPECT_THAT(test::failure(Error::Kind::data, [&] { simplified(surface); }),
                  ::testing::HasSubstr("surface 7"));
    }
}

TEST(RingCheck, IsFastOnAComb) {
  // All edges over one another along x: what a grid or boxes cannot tell apart.
  constexpr int teeth = 100000;
  Ring2 comb{{0, -1}, {1e6, -1}, {1e6, 0}};
  for (int i = teeth; i-- > 0;) {
    comb.emplace_back(1e6 - 1 - i % 2, 2.0 * (teeth - i));
    comb.emplace_back(1 + i % 2, 2.0 * (teeth - i) + 1);
  }
  comb.emplace_back(0, 2.0 * teeth + 2);
  const std::vector<Polygon> polygons{Polygon{comb, {}}};
  EXPECT_EQ(fault_of(polygons), std::nullopt);
}

}  // namespace
}  // namespace octosurf::geometry
