// What is segmented now, what waits, and what expansions leave to segmentation.
#include "detection/waiting.hpp"

#include "detection/expand.hpp"
#include "detection/planelets.hpp"
#include "detection/voxel_blocks.hpp"
#include "support/pending_points.hpp"

#include <gtest/gtest.h>
#include <map>

namespace octosurf::detection {
namespace {

using Index = surfaces::MapView::Index;

/// A floor up to x = 0.9 m is known; what is pending goes on, with a step 3 cm above it from x = 1.02 m on.
class FloorAndStep : public ::testing::Test {
 protected:
  FloorAndStep()
      : points_({test::rectangle_scan(eye_, {0, 0, 0}, {1.3, 0, 0}, {0, 1, 0}),
                 test::rectangle_scan(eye_, {1.02, 0, 0.03}, {0.2, 0, 0}, {0, 1, 0})}) {
    surfaces::SurfaceModel& floor = points_.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0});
    for (const Index i : points_.all)
      if (points_.position(i).x() < 0.9)
        points_.ledger.give(i, floor);
      else
        pending_.push_back(points_.ledger.window[i].key);
  }
  Waiting due_of(const std::vector<geometry::VoxelKey>& before,
                 const std::vector<geometry::VoxelKey>& fresh) {
    return due_to_segment(points_.ledger, points_.state.occupancy, before, fresh, expanded_);
  }

  const Eigen::Vector3d eye_{0.6, 0.5, 2};
  test::PendingPoints points_;
  std::vector<geometry::VoxelKey> pending_;
  std::vector<Assignment> expanded_;
};

TEST_F(FloorAndStep, WhatExpandsBesideANewPlaneIsSegmentedWithIt) {
  expanded_ = expand(points_.ledger, pending_);
  const std::size_t gained = expanded_.size();
  const Waiting waiting = due_of({}, pending_);
  EXPECT_GT(expanded_.size(), 0U);
  EXPECT_LT(expanded_.size(), gained);
  EXPECT_EQ(expanded_.size() + waiting.due.size() + waiting.left.size(), pending_.size());
  const VoxelBlocks blocks(planelet_edge(points_.ledger.grid.resolution()));
  std::map<VoxelBlocks::Place, int> of_step;
  for (const geometry::VoxelKey key : waiting.due)
    if (points_.position(points_.ledger.window.find(key)).z() > 0.02) ++of_step[blocks.of(key)];
  EXPECT_FALSE(of_step.empty());
  const int most = 10;  // of a block's 16 columns: with fewer, a plane is worth less than its description
  for (const Assignment& assignment : expanded_)
    EXPECT_LT(of_step[blocks.of(points_.ledger.window[assignment.point].key)], most);
}

TEST_F(FloorAndStep, WhatWasLookedAtWaitsForAsMuchAgain) {
  const std::vector<geometry::VoxelKey> few(pending_.begin(), pending_.begin() + 4);
  EXPECT_TRUE(due_of({}, few).due.empty());
  EXPECT_EQ(due_of({}, few).left, few);
  EXPECT_GT(20 * due_of({}, pending_).due.size(), 19 * pending_.size());
  // The others have been looked at; half of what waits around has not come again.
  const std::vector<geometry::VoxelKey> fresh{pending_.front()};
  EXPECT_TRUE(due_of({}, fresh).due.empty());
}

}  // namespace
}  // namespace octosurf::detection
