// Rows of bits against a set of cells asked one by one.
#include "geometry/cell_rows.hpp"

#include "support/seed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

namespace octosurf::geometry {
namespace {

using Places = std::map<std::pair<int, int>, std::uint32_t>;  // (v, u) to place in the list

/// Within a square of `extent` cells whose corner lies anywhere, both sides of 0 included.
std::vector<PlaneCell> random_cells(std::mt19937_64& rng, int extent, std::size_t most) {
  std::set<std::pair<int, int>> chosen;
  const int u0 = static_cast<int>(rng() % 1000) - 500, v0 = static_cast<int>(rng() % 1000) - 500;
  const auto somewhere = [&] { return static_cast<int>(rng() % static_cast<unsigned>(extent)); };
  for (std::size_t k = 0; k < most; ++k) {
    const int v = v0 + somewhere(), u = u0 + somewhere();
    chosen.emplace(v, u);
  }
  std::vector<PlaneCell> cells;
  for (const auto& [v, u] : chosen) cells.push_back({u, v});
  return cells;
}

Places places_of(const std::vector<PlaneCell>& cells) {
  Places places;
  for (const PlaneCell cell : cells) places.emplace(std::pair(cell.v, cell.u), places.size());
  return places;
}

struct Size {
  int extent;
  std::size_t most;
};
constexpr Size sizes[] = {{1, 1}, {12, 600}, {30, 700}, {200, 3000}, {500, 60}};

TEST(CellRows, FindsTheCellsAroundOne) {
  std::mt19937_64 rng(test::seed());
  for (const Size size : sizes) {
    const std::vector<PlaneCell> cells = random_cells(rng, size.extent, size.most);
    const Places places = places_of(cells);
    const CellRows rows(cells);
    for (int k = 0; k < 100; ++k) {
      PlaneCell at = cells[rng() % cells.size()];
      at.u += static_cast<int>(rng() % 9) - 4;
      at.v += static_cast<int>(rng() % 9) - 4;
      const int reach = k % 4 == 0 ? 70 : static_cast<int>(rng() % 10);
      std::vector<std::uint32_t> found, expected;
      rows.for_each_run_within(at, reach, [&](std::uint32_t first, std::uint32_t last) {
        for (; first < last; ++first) found.push_back(first);
      });
      for (const auto& [cell, place] : places)
        if (std::abs(cell.first - at.v) <= reach && std::abs(cell.second - at.u) <= reach)
          expected.push_back(place);
      ASSERT_EQ(found, expected) << "reach " << reach;
    }
  }
}

TEST(CellRows, KnowsHowDeepCellsLie) {
  std::mt19937_64 rng(test::seed());
  std::set<int> met;
  for (const Size size : sizes) {
    const std::vector<PlaneCell> cells = random_cells(rng, size.extent, size.most);
    const Places places = places_of(cells);
    const std::vector<std::int8_t> depths = CellRows(cells).depths();
    ASSERT_EQ(depths.size(), cells.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto around = [&](int reach) {
        int count = 0;
        for (int v = -reach; v <= reach; ++v)
          for (int u = -reach; u <= reach; ++u) count += places.contains({cells[c].v + v, cells[c].u + u});
        return count;
      };
      const int expected = around(1) < 9 ? 0 : around(2) < 24 ? 1 : 2;
      ASSERT_EQ(depths[c], expected);
      met.insert(expected);
    }
  }
  EXPECT_EQ(met.size(), 3U);
}

TEST(PointsByCell, IsAStableSort) {
  std::mt19937_64 rng(test::seed());
  for (const Size size : sizes) {
    const std::vector<PlaneCell> some = random_cells(rng, size.extent, size.most);
    std::vector<PlaneCell> cells;
    std::vector<std::uint32_t> points;
    for (std::uint32_t k = 0; k < 2 * some.size(); ++k) {
      cells.push_back(some[rng() % some.size()]);
      points.push_back(7 * k);
    }
    std::vector<std::uint32_t> order(points.size());
    for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(cells[a].v, cells[a].u) < std::pair(cells[b].v, cells[b].u);
    });
    const PointsByCell sorted(points, cells);
    ASSERT_EQ(sorted.points.size(), points.size());
    std::size_t k = 0;
    for (std::size_t c = 0; c < sorted.cells.size(); ++c) {
      ASSERT_FALSE(sorted.of(c).empty());
      for (const std::uint32_t point : sorted.of(c)) {
        ASSERT_EQ(point, points[order[k]]);
        ASSERT_EQ(cells[order[k]].packed(), sorted.cells[c].packed());
        ++k;
      }
      if (c > 0) {
        ASSERT_NE(sorted.cells[c].packed(), sorted.cells[c - 1].packed());
      }
    }
  }
}

TEST(HighestAround, IsNeverTooLow) {
  std::mt19937_64 rng(test::seed());
  for (const Size size : sizes)
    for (const int reach : {1, 3, 8, 20}) {
      const std::vector<PlaneCell> cells = random_cells(rng, size.extent, size.most);
      std::vector<std::uint32_t> labels;
      for (std::size_t c = 0; c < cells.size(); ++c) labels.push_back(static_cast<std::uint32_t>(rng() % 50));
      const HighestAround highest(cells, labels, reach);
      for (int k = 0; k < 50; ++k) {
        const PlaneCell at = cells[rng() % cells.size()];
        std::uint32_t expected = 0;
        for (std::size_t c = 0; c < cells.size(); ++c)
          if (std::abs(cells[c].u - at.u) <= reach && std::abs(cells[c].v - at.v) <= reach)
            expected = std::max(expected, labels[c]);
        ASSERT_GE(highest(at), expected);
      }
    }
}

}  // namespace
}  // namespace octosurf::geometry
