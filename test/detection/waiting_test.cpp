// What is segmented now, what waits, and what expansions leave to segmentation.
#include "detection/waiting.hpp"

#include "detection/expand.hpp"
#include "detection/likelihood_detector.hpp"
#include "support/pending_points.hpp"

namespace octosurf::detection {
namespace {

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

}  // namespace
}  // namespace octosurf::detection
