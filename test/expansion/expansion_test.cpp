#include "expansion/expansion.hpp"

#include "support/map_state.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::expansion {
namespace {

using Index = occupancy::PointWindow::Index;

const Eigen::Vector3d eye(0.5, 0.5, 1.5);
const Plane ground{Eigen::Vector3d::UnitZ(), 0.01};

bool everywhere(const Eigen::Vector3d&) { return true; }

Scan floor_piece(double x0, double x1, double y0, double y1, double z = 0.01) {
  return test::rectangle_scan(eye, {x0, y0, z}, {x1 - x0, 0, 0}, {0, y1 - y0, 0});
}

std::vector<Index> indices(surfaces::Ledger& ledger, const std::vector<occupancy::VoxelPoint>& points) {
  std::vector<Index> all;
  for (const occupancy::VoxelPoint& p : points) all.push_back(ledger.window.find(p.key));
  return all;
}

/// A floor from x = 0 to 1 that is surface 1, and points that have just appeared.
struct Fixture {
  explicit Fixture(const std::vector<Scan>& scans) {
    known = test::occupy(state, floor_piece(0, 1, 0, 1)).appeared;
    {
      surfaces::Ledger ledger(state);
      test::make_surface(ledger, known, ground, everywhere);
    }
    for (const Scan& scan : scans) {
      const auto appeared = test::occupy(state, scan).appeared;
      fresh.insert(fresh.end(), appeared.begin(), appeared.end());
    }
  }
  surfaces::MapState state{Parameters{}};
  std::vector<occupancy::VoxelPoint> known, fresh;
};

SurfaceId owner(const surfaces::MapState& state, const occupancy::VoxelPoint& p) {
  return state.occupancy.at(p.key).point->surface;
}

std::size_t owned(const surfaces::MapState& state, const std::vector<occupancy::VoxelPoint>& points,
                  SurfaceId id) {
  return static_cast<std::size_t>(std::count_if(
      points.begin(), points.end(), [&](const occupancy::VoxelPoint& p) { return owner(state, p) == id; }));
}

TEST(AddInliers, TakesWhatLiesInsideAndReturnsTheRest) {
  // A second layer of voxels 8 mm higher, within s; and points 0.3 m above, which are not.
  Fixture f({floor_piece(0.3, 0.6, 0.3, 0.6, 0.021), floor_piece(0.3, 0.6, 0.3, 0.6, 0.3)});
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  const std::vector<Index> left = expansion.add_inliers(indices(ledger, f.fresh));
  std::size_t low = 0, low_taken = 0, high_taken = 0;
  for (const occupancy::VoxelPoint& p : f.fresh) {
    const bool taken = owner(f.state, p) == 1;
    (p.position.z() < 0.1F ? low_taken : high_taken) += taken;
    low += p.position.z() < 0.1F;
  }
  ASSERT_GT(low, 100U);
  EXPECT_GE(low_taken, low * 9 / 10) << "all but some at the rim, whose normals are not sure";
  EXPECT_EQ(high_taken, 0U);
  EXPECT_EQ(left.size(), f.fresh.size() - low_taken);
  for (const Index i : left) EXPECT_EQ(ledger.window[i].surface, 0U);
}

TEST(AddInliers, TakesNothingSeenFromBehind) {
  // The floor's underside, 1 cm below it, seen from below: within s, but the other side of a board.
  Fixture f({test::rectangle_scan({0.5, 0.5, -1.5}, {0.3, 0.3, -0.001}, {0.3, 0, 0}, {0, 0.3, 0})});
  ASSERT_GT(f.fresh.size(), 100U);
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  const auto left = expansion.add_inliers(indices(ledger, f.fresh));
  EXPECT_EQ(left.size(), f.fresh.size());
  expansion.expand(left);
  EXPECT_EQ(owned(f.state, f.fresh, 1), 0U);
}

TEST(Expand, ReachesOverAGapOfH) {
  const double h = Parameters{}.max_hole_size();
  for (const double gap : {0.5 * h, 2 * h}) {
    Fixture f({floor_piece(1 + gap, 1.4 + gap, 0, 1)});
    surfaces::Ledger ledger(f.state);
    Expansion expansion(ledger);
    expansion.expand(expansion.add_inliers(indices(ledger, f.fresh)));
    const std::size_t taken = owned(f.state, f.fresh, 1);
    if (gap < h)
      EXPECT_EQ(taken, f.fresh.size()) << "then outward until nothing is left";
    else
      EXPECT_EQ(taken, 0U);
  }
}

TEST(Expand, FollowsAPathAroundCorners) {
  // From the floor's edge out, along and back: an arm whose end is 0.5 m away from the floor.
  Fixture f(
      {floor_piece(1, 1.6, 0.4, 0.5), floor_piece(1.5, 1.6, 0.4, 1.5), floor_piece(0.2, 1.6, 1.4, 1.5)});
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  expansion.expand(expansion.add_inliers(indices(ledger, f.fresh)));
  EXPECT_GE(owned(f.state, f.fresh, 1), f.fresh.size() * 99 / 100);
}

TEST(Expand, PicksUpOldPendingPoints) {
  // Only the bridge is new; what lies behind it has been pending for long.
  Fixture f({floor_piece(1.2, 1.8, 0, 1)});
  const auto bridge = test::occupy(f.state, floor_piece(1, 1.2, 0, 1)).appeared;
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  expansion.expand(expansion.add_inliers(indices(ledger, bridge)));
  EXPECT_GE(owned(f.state, f.fresh, 1), f.fresh.size() * 99 / 100);
}

TEST(Expand, StopsAtAWall) {
  // A wall stands on the floor's far edge: of it no more than its foot may be taken.
  Fixture f({test::rectangle_scan(eye, {1, 0, 0.02}, {0, 1, 0}, {0, 0, 0.8})});
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  expansion.expand(expansion.add_inliers(indices(ledger, f.fresh)));
  for (const occupancy::VoxelPoint& p : f.fresh)
    if (owner(f.state, p) == 1) {
      EXPECT_LT(p.position.z(), 0.01F + static_cast<float>(f.state.parameters.surface_tolerance()) + 1e-3F);
    }
  EXPECT_LT(owned(f.state, f.fresh, 1), f.fresh.size() / 20);
}

TEST(Expand, MergesWhatGrewTogetherAndTheLargerKeepsItsId) {
  for (const bool larger_first : {true, false}) {
    surfaces::MapState state{Parameters{}};
    const double border = larger_first ? 0.7 : 0.3;
    const auto a = test::occupy(state, floor_piece(0, border - 0.1, 0, 1)).appeared;
    const auto b = test::occupy(state, floor_piece(border + 0.1, 1, 0, 1)).appeared;
    const auto gap = test::occupy(state, floor_piece(border - 0.1, border + 0.1, 0, 1)).appeared;
    surfaces::Ledger ledger(state);
    test::make_surface(ledger, a, ground, everywhere);
    test::make_surface(ledger, b, ground, everywhere);
    Expansion expansion(ledger);
    expansion.expand(expansion.add_inliers(indices(ledger, gap)));
    ASSERT_EQ(state.surfaces.size(), 1U);
    const SurfaceId kept = larger_first ? 1 : 2, gone = 3 - kept;
    ASSERT_NE(state.surfaces.find(kept), nullptr);
    EXPECT_EQ(state.surfaces.find(kept)->parents(), std::vector<SurfaceId>{gone});
    EXPECT_TRUE(ledger.changes.merged.contains(gone));
    EXPECT_EQ(state.surfaces.find(kept)->size(), a.size() + b.size() + gap.size());
  }
}

TEST(Expand, DoesNotMergeAcrossAStep) {
  surfaces::MapState state{Parameters{}};
  const auto a = test::occupy(state, floor_piece(0, 0.5, 0, 1)).appeared;
  const auto b = test::occupy(state, floor_piece(0.5, 1, 0, 1, 0.08)).appeared;
  surfaces::Ledger ledger(state);
  test::make_surface(ledger, a, ground, everywhere);
  test::make_surface(ledger, b, {Eigen::Vector3d::UnitZ(), 0.08}, everywhere);
  Expansion expansion(ledger);
  expansion.grow(std::vector<SurfaceId>{1, 2});
  EXPECT_EQ(state.surfaces.size(), 2U);
  EXPECT_GE(owned(state, a, 1), a.size() * 99 / 100);
  EXPECT_GE(owned(state, b, 2), b.size() * 99 / 100);
}

TEST(Expand, BetweenTwoPlanesTheBetterFitWins) {
  // Two floors 12 mm apart in height, less than s: every point of the strip between them touches both and
  // fits both. The strip is as short as it is so that the two do not count as grown together.
  constexpr double low = 0.014, high = 0.026;
  surfaces::MapState state{Parameters{}};
  ASSERT_GT(state.parameters.surface_tolerance(), high - low);
  const auto a = test::occupy(state, floor_piece(0, 0.499, 0, 1, low)).appeared;
  const auto b = test::occupy(state, floor_piece(0.521, 1.02, 0, 1, high)).appeared;
  const auto strip_a = test::occupy(state, floor_piece(0.501, 0.519, 0.1, 0.3, low)).appeared;
  const auto strip_b = test::occupy(state, floor_piece(0.501, 0.519, 0.7, 0.9, high)).appeared;
  ASSERT_GE(std::min(strip_a.size(), strip_b.size()), 10U);
  surfaces::Ledger ledger(state);
  test::make_surface(ledger, a, {Eigen::Vector3d::UnitZ(), low}, everywhere);
  test::make_surface(ledger, b, {Eigen::Vector3d::UnitZ(), high}, everywhere);
  std::vector<occupancy::VoxelPoint> strip = strip_a;
  strip.insert(strip.end(), strip_b.begin(), strip_b.end());
  Expansion expansion(ledger);
  expansion.expand(expansion.add_inliers(indices(ledger, strip)));
  ASSERT_EQ(state.surfaces.size(), 2U);
  EXPECT_EQ(owned(state, strip_a, 1), strip_a.size());
  EXPECT_EQ(owned(state, strip_b, 2), strip_b.size());
  EXPECT_EQ(owned(state, a, 1), a.size());
  EXPECT_EQ(owned(state, b, 2), b.size());
}

TEST(Expand, EveryPointHasExactlyOneOwner) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int round = 0; round < 5; ++round) {
    std::vector<Scan> scans;
    for (int i = 0; i < 6; ++i) {
      const double x = 2 * uniform(rng) - 0.5, y = uniform(rng);
      scans.push_back(floor_piece(x, x + 0.4, y, y + 0.3, 0.01 + 0.03 * static_cast<double>(rng() % 3)));
    }
    Fixture f(scans);
    surfaces::Ledger ledger(f.state);
    const std::size_t before = f.state.surfaces.find(1)->size();
    Expansion expansion(ledger);
    std::vector<Index> points;
    for (const occupancy::VoxelPoint& p : f.fresh)
      if (const Index i = ledger.window.find(p.key); i != occupancy::PointWindow::none) points.push_back(i);
    expansion.expand(expansion.add_inliers(points));
    std::size_t mine = 0;
    f.state.occupancy.for_each_point([&](const occupancy::VoxelPoint& p) { mine += p.surface == 1; });
    EXPECT_EQ(f.state.surfaces.find(1)->size(), mine);
    EXPECT_GE(mine, before) << "nothing left on no evidence";
  }
}

TEST(Expand, NothingFromNothing) {
  Fixture f({});
  surfaces::Ledger ledger(f.state);
  Expansion expansion(ledger);
  EXPECT_TRUE(expansion.add_inliers({}).empty());
  expansion.expand({});
  expansion.grow({});
  expansion.grow(std::vector<SurfaceId>{99});  // merged away in the meantime
  EXPECT_TRUE(ledger.changes.touched().empty());
}

}  // namespace
}  // namespace octosurf::expansion
