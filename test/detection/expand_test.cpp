// What is new of surfaces that are there: inside them, over their boundaries, and where that ends.
#include "detection/expand.hpp"

#include "detection/expansion.hpp"
#include "detection/likelihood_detector.hpp"
#include "detection/parts.hpp"
#include "detection/sure_plane.hpp"
#include "detection/waiting.hpp"
#include "support/pending_points.hpp"

namespace octosurf::detection {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

const Eigen::Vector3d eye(0.5, 0.5, 2);

/// Pending points of some rectangles, of which some become a surface's.
class Points : public test::PendingPoints {
 public:
  explicit Points(const std::vector<Scan>& scans, const Parameters& parameters = {})
      : PendingPoints(scans, parameters) {}

  /// Those of a plane and in a region.
  template <class Wanted>
  surfaces::SurfaceModel& surface(const Plane& plane, const Wanted& wanted) {
    surfaces::SurfaceModel& made = ledger.create(plane, position(all.front()));
    for (const PointId i : all)
      if (std::fabs(plane.signed_distance(position(i))) < 0.004 && wanted(position(i))) ledger.give(i, made);
    return made;
  }
  std::vector<PointId> pending() const { return ledger.pending(all); }
};

Scan floor_scan(double from_x, double to_x) {
  return test::rectangle_scan(eye, {from_x, 0, 0}, {to_x - from_x, 0, 0}, {0, 1, 0});
}
const Plane floor_plane{Eigen::Vector3d::UnitZ(), 0};

std::set<PointId> points_of(const std::vector<Assignment>& assignments) {
  std::set<PointId> points;
  for (const Assignment& assignment : assignments) points.insert(assignment.point);
  return points;
}

TEST(AddInliers, FillsHolesAndWhatTheRimCoversAndNothingBeyond) {
  Points points({floor_scan(0, 1)});
  const auto hole = [](const Eigen::Vector3d& p) {
    return (p.head<2>() - Eigen::Vector2d(0.4, 0.5)).norm() < 0.02;
  };
  surfaces::SurfaceModel& floor =
      points.surface(floor_plane, [&](const Eigen::Vector3d& p) { return p.x() < 0.8 && !hole(p); });
  const std::set<PointId> added = points_of(add_inliers(points.ledger, points.pending()));
  std::size_t in_hole = 0;
  for (const PointId i : points.all) {
    if (points.ledger.window[i].surface != 0) continue;
    in_hole += hole(points.position(i));
    EXPECT_EQ(added.contains(i), floor.covers(floor.cell_of(points.ledger.window[i].position)))
        << points.position(i).transpose();
    EXPECT_FALSE(points.position(i).x() > 0.84 && added.contains(i));
  }
  EXPECT_GT(in_hole, 0U);
}

TEST(AddInliers, LeavesWhatLiesOffThePlane) {
  Points points({floor_scan(0, 1), test::rectangle_scan(eye, {0.4, 0.4, 0.05}, {0.2, 0, 0}, {0, 0.2, 0})});
  points.surface(floor_plane, [](const auto&) { return true; });
  EXPECT_THAT(add_inliers(points.ledger, points.pending()), IsEmpty());
}

TEST(AddInliers, GivesAPointToTheSurfaceThatExplainsItBest) {
  Points points({floor_scan(0, 1)});
  surfaces::SurfaceModel& floor =
      points.surface(floor_plane, [](const Eigen::Vector3d& p) { return p.y() < 0.5; });
  const Plane lower{Eigen::Vector3d::UnitZ(), -0.003};
  surfaces::SurfaceModel& other = points.ledger.create(lower, {0, 0, 0});
  for (const PointId i : points.all)
    if (points.position(i).y() >= 0.5 &&
        (points.position(i).head<2>() - Eigen::Vector2d(0.5, 0.5)).norm() > 0.05)
      points.ledger.give(i, other);
  const std::vector<Assignment> added = add_inliers(points.ledger, points.pending());
  EXPECT_THAT(added, Not(IsEmpty()));
  for (const auto& [point, surface] : added)
    EXPECT_TRUE(surface == floor.id() || !floor.covers(floor.cell_of(points.ledger.window[point].position)));
}

TEST(Expand, ReachesTheEndOfWhatIsConnectedAcrossGapsFromWhatItHasJustGained) {
  Points points({floor_scan(0, 1), floor_scan(1.06, 1.3), floor_scan(1.5, 1.8)});
  surfaces::SurfaceModel& floor =
      points.surface(floor_plane, [](const Eigen::Vector3d& p) { return p.x() < 0.4; });
  const std::set<PointId> gained = points_of(expand(points.ledger, points.pending()));
  for (const PointId i : points.all)
    EXPECT_EQ(gained.contains(i) || points.ledger.window[i].surface == floor.id(),
              points.position(i).x() < 1.4)
        << points.position(i).transpose();
}

/// The slow twin: the same rules, with every pending point of the map compared with every cell in every
/// round, instead of a walk from rims.
std::vector<Assignment> expand_by_looking_everywhere(const Points& points) {
  const surfaces::MapView& map = points.ledger;
  Expansion expansion(map);
  std::vector<Assignment> cells, gained;  // at rims, and what was gained; of the last round
  std::vector<PointId> by_key = points.all;
  map.window.put_in_order(by_key);
  for (const PointId i : by_key)
    if (const surfaces::SurfaceModel* its = map.surfaces.find(map.window[i].surface);
        its != nullptr && !its->surrounded(its->cell_of(map.window[i].position)))
      cells.push_back({i, its->id()});
  const auto gain_beside = [&](const std::vector<Assignment>& last) {
    const occupancy::PointSet from(points_of(last));
    std::vector<Assignment> round;
    for (const PointId i : by_key) {
      bool beside = false;
      map.neighbours.for_each_within(i, expansion.reach(), [&](PointId j) { beside |= from.contains(j); });
      if (!beside || expansion.owner(i) != 0) continue;
      if (const SurfaceId id = expansion.surface_beside(i); id != 0) round.push_back({i, id});
    }
    expansion.gain(round);
    return round;
  };
  const auto distance = [&](PointId i, const Assignment& cell) {
    const surfaces::SurfaceModel& surface = *map.surfaces.find(cell.surface);
    const geometry::PlaneCell from = surface.cell_of(map.window[i].position),
                              to = surface.cell_of(map.window[cell.point].position);
    const int u = to.u - from.u, v = to.v - from.v;
    return std::pair(u * u + v * v, to.packed());
  };
  const int most = expansion.plane_gap() * expansion.plane_gap();
  for (std::vector<Assignment> last = cells; !last.empty(); last = gained) {
    for (gained = gain_beside(last); !gained.empty(); gained = gain_beside(gained))
      for (auto* all : {&cells, &last}) all->insert(all->end(), gained.begin(), gained.end());
    occupancy::PointSet looked_at;
    for (const PointId seed : by_key) {
      const auto reaches = [&](const Assignment& cell) {
        return expansion.fits(cell.surface, seed) && distance(seed, cell).first <= most;
      };
      if (expansion.owner(seed) != 0 || looked_at.contains(seed) ||
          std::none_of(last.begin(), last.end(), reaches))
        continue;
      NearestCells nearest;
      for (const Assignment& cell : cells)
        if (reaches(cell)) {
          auto& known = nearest.try_emplace(cell.surface, distance(seed, cell)).first->second;
          known = std::min(known, distance(seed, cell));
        }
      if (const SurfaceId id = expansion.surface_across(seed, nearest); id != 0)
        for (const PointId i : expansion.piece_of(seed, id, looked_at)) gained.push_back({i, id});
    }
    expansion.gain(gained);
    cells.insert(cells.end(), gained.begin(), gained.end());
  }
  return expansion.accepted();
}

std::vector<std::pair<PointId, SurfaceId>> pairs_of(const std::vector<Assignment>& assignments) {
  std::vector<std::pair<PointId, SurfaceId>> pairs;
  for (const auto& [point, surface] : assignments) pairs.emplace_back(point, surface);
  return pairs;
}

TEST(Expand, FromRimsIsFromEverywhere) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> place(0, 1), size(0.05, 0.4), noise(-0.006, 0.006);
  std::size_t gained = 0, contested = 0;
  for (int world = 0; world < 6; ++world) {
    std::vector<Scan> scans{floor_scan(0, 1)};
    for (int k = 0; k < 8; ++k)
      scans.push_back(test::rectangle_scan(eye, {1.4 * place(rng), place(rng), noise(rng)}, {size(rng), 0, 0},
                                           {0, size(rng), 0}));
    scans.push_back(
        test::rectangle_scan(eye, {0.2 + 0.6 * place(rng), 0, 0}, {0, 1, 0}, {0.02, 0, 0.3 * size(rng)}));
    for (Scan& scan : scans) {  // sparse in some places
      const std::size_t step = rng() % 3 == 0 ? 9 : 1;
      std::size_t k = 0;
      std::erase_if(scan.points, [&](const auto&) { return ++k % step != 0; });
    }
    Points points(scans);
    const double end = 0.2 + 0.3 * place(rng), begin = end + 0.3 * place(rng);
    points.surface(floor_plane, [&](const Eigen::Vector3d& p) { return p.x() < end; });
    points.surface({Eigen::Vector3d::UnitZ(), 0.002},
                   [&](const Eigen::Vector3d& p) { return p.x() > begin; });
    points.ledger.apply(add_inliers(points.ledger, points.pending()));
    std::vector<PointId> in_any_order = points.pending();
    std::shuffle(in_any_order.begin(), in_any_order.end(), rng);
    const auto fast = pairs_of(expand(points.ledger, points.pending())),
               slow = pairs_of(expand_by_looking_everywhere(points));
    EXPECT_EQ(pairs_of(expand(points.ledger, in_any_order)), fast);
    const std::map a(fast.begin(), fast.end()), b(slow.begin(), slow.end());
    EXPECT_EQ(a, b) << "world " << world;
    gained += a.size();
    for (const auto& [i, id] : a) contested += id != a.begin()->second;
  }
  EXPECT_GT(gained, 100U);
  EXPECT_GT(contested, 10U) << "both surfaces expand";
}

/// How many points beyond a gap of 6 cm, from x = 1.06 m on, the floor gains.
std::size_t gained_beyond_gap(const std::vector<Scan>& beyond) {
  std::vector<Scan> scans = beyond;
  scans.push_back(floor_scan(0, 1));
  Points points(scans);
  points.surface(floor_plane, [](const Eigen::Vector3d& p) { return p.x() < 1.03; });
  const std::set<PointId> gained = points_of(expand(points.ledger, points.pending()));
  return static_cast<std::size_t>(
      std::count_if(gained.begin(), gained.end(), [&](PointId i) { return points.position(i).x() > 1.03; }));
}

TEST(Expand, TakesAnIslandBeyondAGap) {
  const std::size_t island = Points({floor_scan(1.06, 1.3)}).all.size();
  EXPECT_EQ(gained_beyond_gap({floor_scan(1.06, 1.3)}), island);
  EXPECT_EQ(gained_beyond_gap({floor_scan(1.12, 1.36)}), 0U) << "farther than h";
}

TEST(Expand, LeavesAnIslandOfAnotherPlane) {
  const double rise = std::tan(3 * std::numbers::pi / 180) * 0.4;
  EXPECT_EQ(gained_beyond_gap({test::rectangle_scan(eye, {1.06, 0, 0}, {0.4, 0, rise}, {0, 1, 0})}), 0U);
  EXPECT_EQ(gained_beyond_gap({test::rectangle_scan(eye, {1.06, 0, 0.02}, {0.24, 0, 0}, {0, 1, 0})}), 0U);
}

TEST(Expand, LeavesAnIslandBehindABoardOnThePlane) {
  const Scan board = test::rectangle_scan(eye, {1.01, 0, 0.03}, {0.04, 0, 0}, {0, 1, 0});
  EXPECT_EQ(gained_beyond_gap({floor_scan(1.06, 1.3), board}), 0U);
}

// A plane of a few noisy points is sure of itself in their middle only.
TEST(Expand, AYoungPlaneDoesNotExtrapolate) {
  std::mt19937_64 rng = test::rng();
  std::normal_distribution<double> gauss(0, 0.003);
  Points points({floor_scan(0, 1)});
  const sensing::ReadingModel model(points.state.noise, points.ledger.grid.resolution());
  surfaces::SurfaceModel young(1, floor_plane, {0, 0, 0}, 0.02), old(2, floor_plane, {0, 0, 0}, 0.02);
  const auto add = [&](surfaces::SurfaceModel& surface, double size) {
    for (double x = 0; x < size; x += 0.02)
      for (double y = 0; y < size; y += 0.02) {
        const Eigen::Vector3d p(x, y, gauss(rng));
        geometry::VoxelKey key;
        ASSERT_TRUE(points.ledger.grid.key_of(p.cast<float>(), key));
        surface.add({key, 8, p.cast<float>()});
      }
  };
  add(young, 0.1);
  add(old, 1);
  const SurePlane young_plane(patch_of(young, model), model), old_plane(patch_of(old, model), model);
  occupancy::VoxelPoint near, far;
  for (occupancy::VoxelPoint* point : {&near, &far}) {
    point->view = Eigen::Vector3f::UnitZ();
    point->range_class = 8;
  }
  near.position = {0.05F, 0.05F, 0};
  far.position = {0.95F, 0.95F, 0};
  EXPECT_GT(young_plane.log_ratio(near), 0);
  EXPECT_LT(young_plane.log_ratio(far), 0);
  EXPECT_GT(old_plane.log_ratio(far), 0);
  EXPECT_GT(model.log_ratio(0, 8, 1), 0);  // nothing else speaks against it
}

/// A face that leans against the floor's by so many degrees from x = 1 on.
Scan leaning_scan(double degrees, double width) {
  const double angle = degrees * std::numbers::pi / 180;
  return test::rectangle_scan(eye, {1, 0, 0}, {width * std::cos(angle), 0, width * std::sin(angle)},
                              {0, 1, 0});
}

// Each of its points lies within the noise of the floor's plane; all together they do not.
TEST(Expand, WhatASurfaceGainsIsItsOwnOnlyIfItMerges) {
  Parameters parameters;
  parameters.surfaces.sensor_noise = 0.006;  // m: points belong up to 2 cm off
  Points leaning({floor_scan(0, 1), leaning_scan(3, 0.34)}, parameters);
  Points level({floor_scan(0, 1), leaning_scan(0, 0.34)}, parameters);
  for (Points* points : {&leaning, &level})
    points->surface(floor_plane, [](const Eigen::Vector3d& p) { return p.x() < 1; });
  const auto within_the_gate = [&](const Points& points) {
    const sensing::ReadingModel model(points.state.noise, points.ledger.grid.resolution());
    return static_cast<std::size_t>(std::count_if(points.all.begin(), points.all.end(), [&](PointId i) {
      const occupancy::VoxelPoint& p = points.ledger.window[i];
      return p.surface == 0 && model.gain(p.position.z(), p.range_class, p.view.z()) > 0;
    }));
  };
  ASSERT_EQ(within_the_gate(leaning), leaning.pending().size());
  EXPECT_THAT(expand(leaning.ledger, leaning.pending()), IsEmpty());
  EXPECT_EQ(expand(level.ledger, level.pending()).size(), level.pending().size());
}

// A wall stands on the floor, whose other half is pending behind it.
TEST(Expand, NothingPassesASurfaceThatStandsBetween) {
  const std::vector<Scan> scans{floor_scan(0, 1),
                                test::rectangle_scan({0.2, 0.5, 2}, {0.5, 0, -0.2}, {0, 1, 0}, {0, 0, 0.8})};
  const auto gained_behind = [&](bool with_wall) {
    Points points(scans);
    points.surface(floor_plane, [](const Eigen::Vector3d& p) { return p.x() < 0.48; });
    if (with_wall)
      points.surface({-Eigen::Vector3d::UnitX(), -0.5},
                     [](const Eigen::Vector3d& p) { return std::fabs(p.z()) > 0.012; });
    const std::vector<Assignment> gained = expand(points.ledger, points.pending());
    return std::count_if(gained.begin(), gained.end(),
                         [&](const Assignment& a) { return points.position(a.point).x() > 0.55; });
  };
  EXPECT_GT(gained_behind(false), 500);
  EXPECT_EQ(gained_behind(true), 0);
}

// What is segmented now, what waits, and what expansions leave to segmentation.

/// A floor up to x = 0.9 m is known; what is pending goes on, with a step 3 cm above it from x = 1.02 m on.
class FloorAndStep : public ::testing::Test {
 protected:
  FloorAndStep()
      : points_({test::rectangle_scan(eye_, {0, 0, 0}, {1.3, 0, 0}, {0, 1, 0}),
                 test::rectangle_scan(eye_, {1.02, 0, 0.03}, {0.2, 0, 0}, {0, 1, 0})}) {
    surfaces::SurfaceModel& floor = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0});
    for (const PointId i : points_.all)
      if (points_.position(i).x() < 0.9)
        points_.ledger.give(i, floor);
      else
        pending_.push_back(i);
  }
  Due due_of(const std::vector<PointId>& fresh, const surfaces::PendingQueue& before = {},
             std::optional<std::uint64_t> turn = {}) {
    return due_to_segment(points_.ledger, before, fresh, turn);
  }
  /// Without surfaces every block has its turn in every scan.
  void forget_floor() {
    points_.ledger.dissolve(*points_.ledger.find(points_.ledger.window[points_.all.front()].surface));
  }

  const Eigen::Vector3d eye_{0.6, 0.5, 2};
  test::PendingPoints points_;
  std::vector<PointId> pending_;
};

TEST_F(FloorAndStep, DetectionTakesLeftoversAlone) {
  points_.ledger.apply(expand(points_.ledger, pending_));
  const Due due = due_of(points_.ledger.pending(pending_));
  const auto found = LikelihoodDetector().segment(points_.ledger, {.points = due.points}, 1);
  ASSERT_TRUE(found.has_value());
  std::size_t in_planes = 0;
  for (const auto& [point, label] : found->points) {
    EXPECT_EQ(points_.ledger.window[point].surface, 0U);
    in_planes += label != 0;
  }
  EXPECT_GT(2 * in_planes, due.points.size()) << "of the step";
  const std::vector<PointId> owned{points_.all.front()};
  ASSERT_NE(points_.ledger.window[owned.front()].surface, 0U);
  EXPECT_THROW(LikelihoodDetector().segment(points_.ledger, {.points = owned}, 1), std::logic_error);
}

TEST_F(FloorAndStep, WhatWasLookedAtWaitsForAsMuchAgain) {
  const std::vector<PointId> few(pending_.begin(), pending_.begin() + 4);
  std::vector<geometry::VoxelKey> keys;
  for (const PointId i : few) keys.push_back(points_.ledger.window[i].key);
  EXPECT_TRUE(due_of(few).points.empty());
  EXPECT_EQ(due_of(few).left.fresh, keys);
  EXPECT_TRUE(due_of(few).left.blocks.empty()) << "they were looked at, and wait for more";
  EXPECT_GT(20 * due_of(pending_).points.size(), 19 * pending_.size());
  // The others have been looked at; half of what waits around has not come again.
  EXPECT_TRUE(due_of({pending_.front()}).points.empty());
}

TEST_F(FloorAndStep, NoMoreIsDueThanTheBudgetAndTheOldestBlocksFirst) {
  forget_floor();
  const std::size_t budget = 400;
  points_.state.parameters.detection.detection_budget = static_cast<int>(budget);
  const double border = 0.64;  // m, of the largest blocks of seed patches
  const auto is_far = [&](PointId i) { return points_.position(i).y() >= border; };
  const auto is_far_block = [&](geometry::VoxelKey key) { return is_far(points_.ledger.window.find(key)); };
  std::vector<PointId> near, far;
  for (const PointId i : pending_) (is_far(i) ? far : near).push_back(i);
  ASSERT_GT(far.size(), budget);
  ASSERT_LT(pending_.size(), 4 * budget) << "else a quarter is more";
  Due due = due_of(far, {}, 0);
  std::set<PointId> looked_at;
  std::size_t turns = 0;
  for (std::vector<PointId> fresh = near; !due.left.blocks.empty(); fresh.clear()) {
    ASSERT_LT(++turns, 100U);
    due = due_of(fresh, due.left, turns);
    EXPECT_LE(due.points.size(), budget);
    for (const PointId i : due.points)
      EXPECT_TRUE(looked_at.insert(i).second) << "twice, though nothing has come";
    if (!std::all_of(due.points.begin(), due.points.end(), is_far)) {
      EXPECT_TRUE(std::none_of(due.left.blocks.begin(), due.left.blocks.end(), is_far_block))
          << "which came first";
    }
  }
  EXPECT_GE(turns, (pending_.size() - budget) / budget);
}

TEST_F(FloorAndStep, AQuarterOfWhatWaitsIsDueHoweverSmallTheBudget) {
  forget_floor();
  points_.state.parameters.detection.detection_budget = 1;
  const Due due = due_of(pending_, {}, 0);
  EXPECT_GT(due.points.size(), pending_.size() / 8);
  EXPECT_LE(due.points.size(), pending_.size() / 4);
  EXPECT_GT(due.waiting, pending_.size() / 2);
  points_.state.parameters.detection.detection_budget = 0;
  EXPECT_EQ(due_of(pending_, {}, 0).points, due_of(pending_).points) << "no limit";
}

TEST_F(FloorAndStep, WithABudgetBlocksBesideSurfacesTakeTurns) {
  points_.state.parameters.detection.detection_budget = 100000;
  const std::size_t all = due_of(pending_).points.size();
  std::size_t looked_at = 0, most = 0;
  Due due{.points = {}, .left = {}, .waiting = 0};
  for (std::uint64_t turn = 0; turn < 3; ++turn) {
    due = due_of(turn == 0 ? pending_ : std::vector<PointId>(), due.left, turn);
    looked_at += due.points.size();
    most = std::max(most, due.points.size());
  }
  EXPECT_EQ(looked_at, all);
  EXPECT_LT(most, all);
  EXPECT_TRUE(due.left.blocks.empty());
  EXPECT_EQ(due.waiting, 0U);
}

TEST(Waiting, PointsThatFormNoPlaneAreSegmentedOnce) {
  Scan bush;
  bush.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 2);
  std::mt19937_64 random = test::rng();
  std::uniform_real_distribution<float> length(-0.3F, 0.3F);
  for (int i = 0; i < 300; ++i) bush.points.emplace_back(length(random), length(random), length(random) - 1);
  test::PendingPoints points({bush});
  const Due due = due_to_segment(points.ledger, {}, points.all, {});
  EXPECT_GT(due.points.size(), points.all.size() / 10);
  EXPECT_EQ(due.points.size() + due.left.fresh.size(), points.all.size());
  EXPECT_TRUE(due_to_segment(points.ledger, due.left, {}, {}).points.empty());
}

// What is looked at side by side: how it falls into parts, and how their planes become one proposal.

using surfaces::Proposal;

const Eigen::Vector3d above(1, 0.5, 2);

TEST(Parts, HaveEachPointOnceAndWhatIsWithinHTogether) {
  std::mt19937_64 rng = test::rng();
  std::vector<Scan> boards;
  for (int k = 0; k < 8; ++k) {
    const double x = 0.3 * static_cast<double>(rng() % 20), y = 0.3 * static_cast<double>(rng() % 20);
    boards.push_back(test::rectangle_scan(above, {x, y, 0}, {0.6, 0, 0}, {0, 0.6, 0}));
  }
  const test::PendingPoints points(boards);
  const std::vector<Part> parts = divided(points.ledger, {.points = points.all});
  std::vector<PointId> all;
  std::vector<std::size_t> part_of(points.ledger.window.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    EXPECT_TRUE(k == 0 || parts[k].points.size() <= parts[k - 1].points.size()) << "the largest first";
    std::vector<PointId> in_order = parts[k].points;
    points.ledger.window.put_in_order(in_order);
    EXPECT_EQ(in_order, parts[k].points);
    for (const PointId i : parts[k].points) part_of[index_of(i)] = k;
    all.insert(all.end(), parts[k].points.begin(), parts[k].points.end());
  }
  points.ledger.window.put_in_order(all);
  EXPECT_EQ(all, points.all);
  const double h = points.ledger.parameters.max_hole_size();
  for (int k = 0; k < 20'000; ++k) {
    const PointId a = points.all[rng() % points.all.size()], b = points.all[rng() % points.all.size()];
    if ((points.position(a) - points.position(b)).norm() >= h) continue;
    ASSERT_EQ(part_of[index_of(a)], part_of[index_of(b)]);
  }
}

/// Two boards 2 m apart, of some 2,500 readings each, and between them a line that belongs to the first.
class TwoBoards : public ::testing::Test {
 protected:
  surfaces::SurfaceModel& known(double from_x, double to_x) {
    surfaces::SurfaceModel& surface = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0});
    for (const PointId i : points_.all)
      if (points_.position(i).x() >= from_x && points_.position(i).x() <= to_x)
        points_.ledger.give(i, surface);
    return surface;
  }
  std::vector<PointId> left() const { return between(-1, 1.1); }
  std::vector<PointId> right() const { return between(2.6, 4); }
  std::vector<PointId> between(double from_x, double to_x) const {
    std::vector<PointId> some;
    for (const PointId i : points_.all)
      if (points_.position(i).x() > from_x && points_.position(i).x() < to_x) some.push_back(i);
    return some;
  }

  test::PendingPoints points_{{test::rectangle_scan(above, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                               test::rectangle_scan(above, {2.7, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                               test::rectangle_scan(above, {1.3, 0.3, 0}, {1.1, 0, 0}, {0, 0.1, 0})}};
};

TEST_F(TwoBoards, AreTwoPartsUnlessASurfaceHasReadingsOfBoth) {
  std::vector<PointId> both = left();
  for (const PointId i : right()) both.push_back(i);
  points_.ledger.window.put_in_order(both);
  ASSERT_EQ(divided(points_.ledger, {.points = both}).size(), 2U);
  const SurfaceId id = known(0.6, 2.8).id();
  const std::vector<Part> parts = divided(points_.ledger, {.surfaces = {id}, .gained = both});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts.front().surfaces, std::vector{id});
  EXPECT_EQ(parts.front().gained, both);
}

TEST_F(TwoBoards, SmallPartsArePutTogether) {
  std::vector<PointId> few;
  for (const std::vector<PointId>& board : {left(), right()})
    few.insert(few.end(), board.begin(), board.begin() + 100);
  points_.ledger.window.put_in_order(few);
  EXPECT_EQ(divided(points_.ledger, {.points = few}).size(), 1U);
}

TEST_F(TwoBoards, OfOneSurfaceInTwoPartsAreOnePlane) {
  const surfaces::SurfaceModel& line = known(1.2, 2.5);
  JointProposal joint(points_.ledger);
  const auto found = [&](const std::vector<PointId>& points, double x) {
    Proposal proposal;
    proposal.planes.push_back({{Eigen::Vector3d::UnitZ(), 0}, {x, 0, 0}});
    for (const PointId i : points) proposal.points.push_back({i, 1});
    proposal.rest.push_back({line.id(), 1, 0});
    return proposal;
  };
  joint.add(found(left(), 0), points_.ledger.window);
  joint.add(found(right(), 3), points_.ledger.window);
  Proposal alone = found({left().front(), points_.all.back()}, 9);  // the first one is taken already
  alone.rest.clear();
  joint.add(alone, points_.ledger.window);
  const Proposal all = std::move(joint).take();
  ASSERT_EQ(all.planes.size(), 2U) << "and none of a single reading";
  ASSERT_EQ(all.rest.size(), 1U);
  EXPECT_EQ(all.rest.front().label, 1U);
  EXPECT_EQ(all.rest.front().readings, static_cast<double>(line.size()));
  std::set<PointId> labelled;
  for (const auto& [point, label] : all.points) {
    EXPECT_TRUE(labelled.insert(point).second);
    EXPECT_EQ(label, labelled.size() <= left().size() + right().size() ? 1U : 0U);
  }
}

}  // namespace
}  // namespace octosurf::detection
