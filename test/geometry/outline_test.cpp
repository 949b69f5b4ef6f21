// The outline kept up to date against alpha_shape() of the sites that are in, bit for bit.
#include "geometry/outline.hpp"

#include "support/alpha_shape_twin.hpp"
#include "support/polygons.hpp"
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

/// Discs in holes of discs: every hole goes to the smallest ring about it, whatever the boxes say. Of a
/// square of four sites, cocircular ones, all is in; of three at its corners half.
TEST(Outline, IslandsInHolesArePolygonsOfTheirOwn) {
  Outline outline(1.9);
  Sites sites;
  for (int v = -40; v <= 40; ++v)
    for (int u = -40; u <= 40; ++u)
      if (const double r = std::hypot(u, v); static_cast<int>(r / 5) % 2 == 0 && r < 40)
        sites[{u, v}] = {{u + 0.5, v + 0.5}};
  for (const auto& [cell, of_cell] : sites) outline.set({cell.first, cell.second}, of_cell);
  const std::vector<Polygon> polygons = outline.update();
  EXPECT_EQ(polygons.size(), 4U);  // a disc of radius 5 and three rings
  std::size_t holes = 0;
  for (const Polygon& polygon : polygons) {
    EXPECT_LE(polygon.holes.size(), 1U);
    holes += polygon.holes.size();
  }
  EXPECT_EQ(holes, 3U);
  double area = 0;
  for (int v = -40; v <= 40; ++v)
    for (int u = -40; u <= 40; ++u) {
      int corners = 0;
      for (const Cell& at : {Cell(u, v), Cell(u + 1, v), Cell(u, v + 1), Cell(u + 1, v + 1)})
        corners += sites.contains(at);
      area += corners == 4 ? 1 : corners == 3 ? 0.5 : 0;
    }
  EXPECT_NEAR(test::area(polygons), area, 1e-9);
  EXPECT_TRUE(test::identical(polygons, alpha_shape(all_of(sites), 1.9)));
}

}  // namespace
}  // namespace octosurf::geometry
