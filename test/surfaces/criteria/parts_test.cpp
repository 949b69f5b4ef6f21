// One plane or two: patches made by hand, whose planes are known.
#include "surfaces/criteria/parts.hpp"

#include "support/map_state.hpp"
#include "support/seed.hpp"
#include "surfaces/blobs.hpp"
#include "surfaces/criteria/obstructed.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <set>

namespace octosurf::surfaces {
namespace {

using Index = MapView::Index;
using Points = std::vector<Eigen::Vector3d>;
using Rng = std::mt19937_64;

constexpr double degree = std::numbers::pi / 180;
constexpr double d = 0.02, s = 0.015;  // the defaults

/// Points every 2 cm on a rectangle, as voxels keep them, scattered along `noise`.
Points rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_u, const Eigen::Vector3d& edge_v,
                 const Eigen::Vector3d& noise, Rng& rng) {
  std::normal_distribution<double> gauss(0, 1);
  const auto steps = [](const Eigen::Vector3d& e) { return static_cast<int>(std::lround(e.norm() / d)); };
  Points points;
  for (int v = 0; v <= steps(edge_v); ++v)
    for (int u = 0; u <= steps(edge_u); ++u)
      points.emplace_back(corner + u * d * edge_u.normalized() + v * d * edge_v.normalized() +
                          gauss(rng) * noise);
  return points;
}

Patch patch_of(const Points& points) {
  Patch patch;
  patch.reference = points.front();
  for (const Eigen::Vector3d& p : points) patch.moments.add(p - patch.reference);
  patch.points = static_cast<double>(points.size());
  return patch;
}

/// The answer, which must be the same whichever patch comes first.
bool one(const Points& a, const Points& b, const Plane& about, const Eigen::Vector3d& contact) {
  const bool answer = one_plane(patch_of(a), patch_of(b), about, contact, s, d);
  EXPECT_EQ(answer, one_plane(patch_of(b), patch_of(a), about, contact, s, d)) << "not symmetric";
  return answer;
}

const Plane level{Eigen::Vector3d::UnitZ(), 0};
const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);

TEST(OnePlane, EqualPlanesAre) {
  Rng rng = test::rng();
  for (const double noise : {0.0, 0.001, 0.005}) {
    const Points a = rectangle({0, 0, 0}, 0.4 * x, 0.4 * y, noise * z, rng),
                 b = rectangle({0.44, 0, 0}, 0.4 * x, 0.4 * y, noise * z, rng);
    EXPECT_TRUE(one(a, b, level, {0.42, 0.2, 0})) << "noise " << noise;
    EXPECT_TRUE(one(a, a, level, {0.2, 0.2, 0}));
  }
}

TEST(OnePlane, AStepOfACentimetreIsNot) {
  Rng rng = test::rng();
  for (const double noise : {0.0, 0.001, 0.003})
    for (const double step : {-0.01, 0.01}) {
      const Points a = rectangle({0, 0, 0}, 0.4 * x, 0.4 * y, noise * z, rng),
                   b = rectangle({0.42, 0, step}, 0.4 * x, 0.4 * y, noise * z, rng);
      EXPECT_FALSE(one(a, b, level, {0.41, 0.2, step / 2})) << "step " << step << ", noise " << noise;
    }
}

TEST(OnePlane, ALeanOfTwoAndAHalfDegreesIsNot) {
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  for (int round = 0; round < 20; ++round) {
    const double lean = (round % 2 == 0 ? 2.5 : -2.5) * degree;
    const Points a = rectangle({0, 0, 0}, 0.5 * x, 0.3 * y, 0.003 * z, rng);
    const Points b =
        rectangle({0.52, 0, 0}, 0.5 * (std::cos(lean) * x + std::sin(lean) * z), 0.3 * y, 0.003 * z, rng);
    EXPECT_FALSE(one(a, b, level, {0.51, 0.15, 0})) << "round " << round;
  }
}

TEST(OnePlane, ASmallNoisyPatchMayBelong) {
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  for (int round = 0; round < 20; ++round) {
    const Points large = rectangle({0, 0, 0}, 0.6 * x, 0.6 * y, 0.002 * z, rng);
    const Points small = rectangle({0.62, 0.2, 0}, 0.1 * x, 0.18 * y, 0.006 * z, rng);
    ASSERT_EQ(small.size(), 60U);
    EXPECT_TRUE(one(large, small, level, {0.61, 0.29, 0})) << "round " << round;
  }
}

TEST(OnePlane, ALaserLineMayBelongToTheFloorBesideIt) {
  // Seen from 1 m above, 1.5 m away: the readings scatter up and down the line of sight, so that the
  // slope across the line that fits them best is the ray's.
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  const Eigen::Vector3d ray = Eigen::Vector3d(1.5, 0, -1).normalized();
  for (int round = 0; round < 20; ++round) {
    const Points floor = rectangle({0, 0, 0}, 0.4 * x, 0.5 * y, 0.004 * ray, rng);
    const Points line = rectangle({0.44, 0, 0}, 0 * x, 0.5 * y, 0.004 * ray, rng);
    ASSERT_EQ(line.size(), 26U);
    EXPECT_TRUE(one(floor, line, level, {0.42, 0.25, 0})) << "round " << round;
  }
}

TEST(OnePlane, HoldsFarFromTheOrigin) {
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 100; ++round) {
    Eigen::Isometry3d pose = test::random_pose(rng);
    pose.translation() = 100 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized();
    const Eigen::Vector3d u = pose.linear().col(0), v = pose.linear().col(1), n = pose.linear().col(2),
                          o = pose.translation();
    const double width = 0.35 + 0.15 * uniform(rng), depth = 0.35 + 0.15 * uniform(rng);
    const Points a = rectangle(o, width * u, depth * v, 0.003 * n, rng);
    const auto beside = [&](double height, double lean) {
      return rectangle(o + (width + 0.04) * u + height * n, 0.5 * (std::cos(lean) * u + std::sin(lean) * n),
                       0.5 * v, 0.003 * n, rng);
    };
    // The plane they are asked about is only nearly theirs.
    const Eigen::Vector3d m = (n + 0.005 * uniform(rng) * u + 0.005 * uniform(rng) * v).normalized();
    const Plane about{m, m.dot(o)};
    const Eigen::Vector3d contact = o + (width + 0.02) * u + depth / 2 * v;
    EXPECT_TRUE(one(a, beside(0, 0), about, contact)) << "round " << round;
    EXPECT_FALSE(one(a, beside(0.025, 0), about, contact)) << "a step, round " << round;
    EXPECT_FALSE(one(a, beside(0, 5 * degree), about, contact)) << "a lean, round " << round;
  }
}

/// Voxels of a scene, with the index of each.
struct Voxels {
  explicit Voxels(const Parameters& parameters = {}) : state(parameters) {}

  /// The new points of a rectangle seen from `eye`; every point of the scan moved along `noise`.
  std::vector<geometry::VoxelKey> see(const Eigen::Vector3d& eye, const Eigen::Vector3d& corner,
                                      const Eigen::Vector3d& edge_u, const Eigen::Vector3d& edge_v,
                                      const Eigen::Vector3d& noise, Rng& rng) {
    std::normal_distribution<double> gauss(0, 1);
    Scan scan = test::rectangle_scan(eye, corner, edge_u, edge_v);
    for (Eigen::Vector3f& p : scan.points) p += (gauss(rng) * noise).cast<float>();
    std::vector<geometry::VoxelKey> keys;
    for (const occupancy::VoxelPoint& p : test::occupy(state, scan).appeared) keys.push_back(p.key);
    return keys;
  }

  MapState state;
};

std::vector<Index> indices(Ledger& ledger, const std::vector<std::vector<geometry::VoxelKey>>& lists) {
  std::vector<Index> all;
  for (const auto& keys : lists)
    for (const geometry::VoxelKey key : keys) all.push_back(ledger.window.find(key));
  return all;
}

using Parts = std::set<std::set<Index>>;

/// Parts as sets; each point must be in one of them and nothing else.
Parts parts(Ledger& ledger, const std::vector<Index>& points, const Plane& plane) {
  Parts found;
  std::multiset<Index> held;
  for (const std::vector<Index>& part : parts_of(ledger, points, plane)) {
    EXPECT_FALSE(part.empty());
    held.insert(part.begin(), part.end());
    found.emplace(part.begin(), part.end());
  }
  EXPECT_EQ(held, std::multiset<Index>(points.begin(), points.end())) << "not a partition";
  return found;
}

TEST(Obstructed, ABoardStandsBetweenTwoPointsOfAWall) {
  Rng rng = test::rng();
  Voxels voxels;
  const Eigen::Vector3d eye(1.5, 0.5, 1.2), back(0, 0, 0);
  voxels.see(eye, {0.005, 0, 0.5}, y, 0.5 * z, 0.002 * x, rng);
  voxels.see(eye, {0.005, 0, 1.03}, y, 0.5 * z, 0.002 * x, rng);
  const Plane wall{x, 0.005};
  const Eigen::Vector3d below(0.005, 0.5, 0.99), above(0.005, 0.5, 1.04);
  const double reach = voxels.state.noise.tolerance(4);
  {
    Ledger ledger(voxels.state);
    EXPECT_FALSE(obstructed(ledger, wall, below, above, reach)) << "nothing is there";
    EXPECT_FALSE(obstructed(ledger, wall, below, {0.005, 0.5, 0.6}, reach)) << "but the wall and its noise";
  }
  voxels.see(eye, {0.005, 0, 1.03}, y, 0.3 * x, 0.001 * z, rng);  // its top
  Ledger ledger(voxels.state);
  EXPECT_TRUE(obstructed(ledger, wall, below, above, reach));
  EXPECT_TRUE(obstructed(ledger, wall, above, below, reach));
  EXPECT_FALSE(obstructed(ledger, wall, below, {0.005, 0.5, 0.6}, reach)) << "beside the board";
}

TEST(Obstructed, FurtherUpOnlyByWhatDoesNotFaceThePlane) {
  Rng rng = test::rng();
  Voxels voxels;
  const Plane wall{x, 0.005};
  const Eigen::Vector3d below(0.005, 0.5, 0.99), above(0.005, 0.5, 1.04);
  const double reach = voxels.state.noise.tolerance(4);
  const int layers = 4;
  // A crack's other side, 7 cm off, seen from in between.
  voxels.see({0.04, 0.5, 1.0}, {0.075, 0.3, 0.8}, 0.4 * y, 0.4 * z, 0.001 * x, rng);
  {
    Ledger ledger(voxels.state);
    EXPECT_FALSE(obstructed(ledger, wall, below, above, reach, layers));
  }
  voxels.see({1.5, 0.5, 1.2}, {0.06, 0.45, 1.015}, 0.2 * x, 0.1 * y, 0.001 * z, rng);  // a board's outer part
  Ledger ledger(voxels.state);
  EXPECT_FALSE(obstructed(ledger, wall, below, above, reach)) << "not in the lowest layer";
  EXPECT_TRUE(obstructed(ledger, wall, below, above, reach, layers));
}

TEST(Obstructed, NoiseOfThePlaneItselfIsNoObstacle) {
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  Voxels voxels;
  const Eigen::Vector3d eye(0.5, 0.5, 1.5);
  for (int i = 0; i < 4; ++i) voxels.see(eye, {0, 0, 0.01}, x, y, 0.004 * z, rng);
  Ledger ledger(voxels.state);
  const Plane ground{z, 0.01};
  std::uniform_real_distribution<double> side(0.05, 0.95);
  int blocked = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d a(side(rng), side(rng), 0.01), b(side(rng), side(rng), 0.01);
    blocked += obstructed(ledger, ground, a, b, voxels.state.noise.tolerance(6));
  }
  EXPECT_EQ(blocked, 0);
}

/// Tops of two blocks side by side, the second leaning; a few readings bridge the gap between them.
struct Blocks {
  explicit Blocks(double lean, double gap, const Parameters& parameters = {},
                  std::uint64_t seed = test::seed())
      : rng(seed), voxels(parameters) {
    const Eigen::Vector3d eye(0.5, 0.2, 1.5);
    const Eigen::Vector3d along = std::cos(lean) * x + std::sin(lean) * z;
    lists.push_back(voxels.see(eye, {0, 0, 0.31}, 0.5 * x, 0.4 * y, 0.002 * z, rng));
    lists.push_back(voxels.see(eye, {0.5 + gap, 0, 0.31}, 0.5 * along, 0.4 * y, 0.002 * z, rng));
    if (gap < 0.05)
      for (const double at : {0.06, 0.2, 0.33})
        lists.push_back(voxels.see(eye, {0.5, at, 0.31}, gap * x, 0.015 * y, 0.002 * z, rng));
  }
  Plane plane() const { return {z, 0.31}; }

  Rng rng;
  Voxels voxels;
  std::vector<std::vector<geometry::VoxelKey>> lists;
};

TEST(PartsOf, BlocksThatLeanAgainstOneAnotherAreTwo) {
  const std::uint64_t seed = test::seed();
  for (std::uint64_t round = 0; round < 10; ++round)
    for (const double lean : {-3 * degree, 3 * degree}) {
      Blocks blocks(lean, 0.04, {}, seed + round);
      Ledger ledger(blocks.voxels.state);
      const Parts found = parts(ledger, indices(ledger, blocks.lists), blocks.plane());
      ASSERT_EQ(found.size(), 2U) << "round " << round;
      // What bridges the gap may go either way, the blocks may not.
      for (const std::set<Index>& part : found) {
        std::size_t left = 0, right = 0;
        for (const Index i : part) (ledger.window[i].position.x() < 0.5F ? left : right) += 1;
        EXPECT_LE(std::min(left, right), 30U);
        EXPECT_GE(std::max(left, right), 400U);
      }
    }
}

TEST(PartsOf, BlocksOfOnePlaneAreOneAcrossAGapOfH) {
  for (const double gap : {0.04, 0.06}) {
    Blocks blocks(0, gap);
    Ledger ledger(blocks.voxels.state);
    EXPECT_EQ(parts(ledger, indices(ledger, blocks.lists), blocks.plane()).size(), 1U) << "gap " << gap;
  }
  Blocks blocks(0, 0.15);
  Ledger ledger(blocks.voxels.state);
  EXPECT_EQ(parts(ledger, indices(ledger, blocks.lists), blocks.plane()).size(), 2U) << "further than h";
}

/// But for a few points at its rim that holes have cut off: the test whether these are of the plane says no
/// once in a thousand times, which is in one rectangle of 2500 (14 points at most in 42,000 of them), and so
/// in two of twelve in one world of 100,000.
TEST(PartsOf, AHoleyNoisyRectangleIsOne) {
  const std::uint64_t seed = test::seed();
  Rng rng(seed);
  int divided = 0;
  for (int round = 0; round < 12; ++round) {
    Eigen::Isometry3d pose = test::random_pose(rng);
    if (round < 3) pose.linear() = geometry::plane_axes(Eigen::Vector3d::Unit(round));
    const Eigen::Vector3d u = pose.linear().col(0), v = pose.linear().col(1), n = pose.linear().col(2);
    Voxels voxels;
    const auto keys = voxels.see(pose.translation() + 1.5 * n, pose.translation() - 0.5 * u - 0.3 * v, u,
                                 0.6 * v, 0.004 * n, rng);
    Ledger ledger(voxels.state);
    std::vector<Index> kept;
    for (const Index i : indices(ledger, {keys}))
      if (rng() % 10 != 0) kept.push_back(i);
    const Parts found = parts(ledger, kept, test::plane_of(pose));
    std::size_t largest = 0;
    for (const std::set<Index>& part : found) largest = std::max(largest, part.size());
    EXPECT_LE(kept.size() - largest, kept.size() / 50) << "round " << round;
    divided += found.size() > 1;
  }
  EXPECT_LE(divided, 1);
}

TEST(PartsOf, AShelfsBoardDividesTheWallBehindIt) {
  for (const bool with_board : {true, false}) {
    Rng rng = test::rng();
    Voxels voxels;
    const Eigen::Vector3d high(1.5, 0.5, 1.3), low(1.5, 0.5, 0.7);
    const auto above = voxels.see(high, {0.005, 0, 1.03}, y, 0.5 * z, 0.002 * x, rng);
    const auto below = voxels.see(low, {0.005, 0, 0.5}, y, 0.5 * z, 0.002 * x, rng);
    if (with_board) {
      voxels.see(high, {0.025, 0, 1.03}, 0.28 * x, y, 0.001 * z, rng);
      voxels.see(low, {0.025, 0, 1.0}, 0.28 * x, y, 0.001 * z, rng);
      voxels.see(low, {0.305, 0, 1.0}, 0.03 * z, y, 0.001 * x, rng);
    }
    Ledger ledger(voxels.state);
    const Parts found = parts(ledger, indices(ledger, {above, below}), {x, 0.005});
    EXPECT_EQ(found.size(), with_board ? 2U : 1U) << (with_board ? "" : "nothing in the gap");
  }
}

TEST(PartsOf, AWallWithHolesIsOneAcrossAGap) {
  // A fifth of the wall's cells without a reading, and nothing in the gap. That a board seen in lines divides
  // such a wall holds in one of three worlds only (68 of 200), and is not claimed.
  Rng rng(test::seed());
  Voxels voxels;
  const Eigen::Vector3d high(1.5, 0.6, 1.3), low(1.5, 0.6, 0.7);
  const auto above = voxels.see(high, {0.005, 0, 1.03}, 1.2 * y, 0.5 * z, 0.002 * x, rng);
  const auto below = voxels.see(low, {0.005, 0, 0.5}, 1.2 * y, 0.5 * z, 0.002 * x, rng);
  Ledger ledger(voxels.state);
  std::vector<Index> kept;
  for (const Index i : indices(ledger, {above, below}))
    if (rng() % 5 != 0) kept.push_back(i);
  std::size_t of_some_size = 0;
  for (const std::set<Index>& part : parts(ledger, kept, {x, 0.005})) of_some_size += part.size() >= 50;
  EXPECT_EQ(of_some_size, 1U);
}

TEST(PartsOf, TheOrderOfThePointsDoesNotMatter) {
  // But for the first, at which the cells begin.
  const std::uint64_t seed = test::seed();
  for (std::uint64_t round = 0; round < 10; ++round) {
    Blocks blocks(3 * degree, 0.04, {}, seed + round);
    Ledger ledger(blocks.voxels.state);
    std::vector<Index> points = indices(ledger, blocks.lists);
    const Parts first = parts(ledger, points, blocks.plane());
    for (int k = 0; k < 3; ++k) {
      std::shuffle(points.begin() + 1, points.end(), blocks.rng);
      const bool same = parts(ledger, points, blocks.plane()) == first;
      EXPECT_TRUE(same) << "round " << round << ", shuffle " << k;
    }
  }
}

TEST(PartsOf, ThePapersAreClustersByHAlone) {
  Parameters paper = Parameters::paper();
  ASSERT_FALSE(paper.aligned());
  for (const double gap : {0.04, 0.06, 0.15}) {
    Blocks blocks(3 * degree, gap, paper);
    Ledger ledger(blocks.voxels.state);
    EXPECT_EQ(parts(ledger, indices(ledger, blocks.lists), blocks.plane()).size(), gap < 0.08 ? 1U : 2U)
        << "gap " << gap;
  }
}

}  // namespace
}  // namespace octosurf::surfaces
