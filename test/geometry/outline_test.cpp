// The outline kept up to date against alpha_shape() of the sites that are in, bit for bit.
#include "geometry/outline.hpp"

#include "geometry/rings.hpp"
#include "geometry/simplify.hpp"
#include "support/alpha_shape_twin.hpp"
#include "surfaces/blobs.hpp"

namespace octosurf::geometry {
namespace {

using Cell = std::pair<int, int>;
using Sites = std::map<Cell, std::vector<Eigen::Vector2d>>;

std::vector<Eigen::Vector2d> all_of(const Sites& sites) {
  std::vector<Eigen::Vector2d> all;
  for (const auto& [cell, of_cell] : sites) all.insert(all.end(), of_cell.begin(), of_cell.end());
  return all;
}

/// Sites change a few cells at a time; `content` draws what a cell holds from then on.
template <class Content>
void expect_alpha_shape_throughout(std::mt19937_64& rng, double alpha, int extent, int rounds,
                                   const Content& content) {
  Outline outline(alpha);
  Sites sites;
  std::uniform_int_distribution<int> somewhere(-extent, extent);
  for (int round = 0; round < rounds; ++round) {
    // Now and then everything goes, or nearly.
    const bool emptied = rng() % 16 == 0;
    std::set<Cell> cells;
    if (emptied)
      for (const auto& [cell, of_cell] : sites)
        if (rng() % 8 != 0) cells.insert(cell);
    for (int i = static_cast<int>(rng() % 40); i > 0; --i) cells.emplace(somewhere(rng), somewhere(rng));
    for (const Cell& cell : cells) {
      std::vector<Eigen::Vector2d> wanted;
      if (!emptied) wanted = content(cell);
      outline.set({cell.first, cell.second}, wanted);
      sites.erase(cell);
      if (!wanted.empty()) sites[cell] = wanted;
    }
    std::vector<Eigen::Vector2d> all = all_of(sites);
    std::shuffle(all.begin(), all.end(), rng);
    ASSERT_TRUE(test::identical(outline.update(), alpha_shape(all, alpha))) << "round " << round;
  }
}

TEST(Outline, IsTheAlphaShapeOfWhatIsIn) {
  std::mt19937_64 rng = test::rng();
  std::uniform_int_distribution<int> within(0, 4095);
  for (const double alpha : {1.3, 2.0, 3.99})
    expect_alpha_shape_throughout(rng, alpha, 12, 120, [&](const Cell& cell) {
      std::vector<Eigen::Vector2d> sites;
      for (int n = static_cast<int>(rng() % 4); n > 0; --n)
        sites.emplace_back(cell.first + within(rng) * Outline::quantum,
                           cell.second + within(rng) * Outline::quantum);
      return sites;
    });
}

/// On a grid nearly all sites are collinear and cocircular with others, and equal ones meet at the
/// cells' borders: the triangulation must not depend on the order in which they came and went.
TEST(Outline, DoesNotDependOnHistoryOnAGrid) {
  std::mt19937_64 rng = test::rng();
  for (const double step : {1.0, 0.5})
    for (const double alpha : {1.0, 1.5, 2.3})
      expect_alpha_shape_throughout(rng, alpha, 7, 150, [&](const Cell& cell) {
        std::vector<Eigen::Vector2d> sites;
        for (int n = static_cast<int>(rng() % 3); n > 0; --n)
          sites.emplace_back(cell.first + step * static_cast<double>(rng() % 3),
                             cell.second + step * static_cast<double>(rng() % 3));
        return sites;
      });
}

TEST(Outline, SurvivesSitesOnALine) {
  std::mt19937_64 rng = test::rng();
  expect_alpha_shape_throughout(rng, 2.0, 3, 300, [&](const Cell& cell) {
    const bool off = rng() % 12 == 0;
    return std::vector<Eigen::Vector2d>{{cell.first, off ? 1 : 0}};
  });
}

/// Discs in holes of discs: every hole goes to the smallest ring about it, whatever the boxes say.
TEST(Outline, IslandsInHolesArePolygonsOfTheirOwn) {
  Outline outline(1.9);
  std::vector<Eigen::Vector2d> sites;
  for (int v = -40; v <= 40; ++v)
    for (int u = -40; u <= 40; ++u)
      if (const double r = std::hypot(u, v); static_cast<int>(r / 5) % 2 == 0 && r < 40) {
        sites.emplace_back(u + 0.5, v + 0.5);
        outline.set({u, v}, {&sites.back(), 1});
      }
  const std::vector<Polygon> polygons = outline.update();
  EXPECT_EQ(polygons.size(), 4U);  // a disc of radius 5 and three rings
  EXPECT_TRUE(test::identical(polygons, alpha_shape(sites, 1.9)));
}

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
