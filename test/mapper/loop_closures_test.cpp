// Where a recording's poses stop meeting what was mapped before.
#include "loop_closures.hpp"

#include <gtest/gtest.h>

namespace octosurf::mapper {
namespace {

struct Correction {
  double x;  ///< m
  AlignmentOutcome outcome = AlignmentOutcome::corrected;
};

/// Of a recording whose scan i is given at the origin and corrected along x.
auto closures_of(const std::vector<Correction>& corrections) {
  LoopClosures closures;
  for (std::size_t i = 0; i < corrections.size(); ++i) {
    Scan scan;
    scan.name = std::to_string(i);
    Alignment alignment;
    alignment.outcome = corrections[i].outcome;
    alignment.T_map_sensor.translation().x() = corrections[i].x;
    closures.add(scan, alignment, 0.02);
  }
  return closures.all();
}

TEST(LoopClosures, AStepThatLastsIsOne) {
  const auto closures = closures_of({{0}, {0.05}, {0.051}, {0.052}});
  ASSERT_EQ(closures.size(), 1U);
  EXPECT_EQ(closures[0].first, "1");
  EXPECT_EQ(closures[0].last, "1");
  EXPECT_DOUBLE_EQ(closures[0].farthest_m, 0.05);
  EXPECT_EQ(closures_of({{0}, {0.2, AlignmentOutcome::recovered}, {0.2}}).size(), 1U)
      << "found by its planes";
}

TEST(LoopClosures, ASingleJumpAStepBelowAVoxelAndTheLastScanAreNone) {
  // What comes after the jump is expected from what was before it.
  EXPECT_TRUE(closures_of({{0.01}, {0.2, AlignmentOutcome::recovered}, {0.011}, {0.012}}).empty());
  std::vector<Correction> drift;
  for (int i = 0; i < 50; ++i) drift.push_back({0.015 * i});
  drift.push_back({1});
  EXPECT_TRUE(closures_of(drift).empty());
}

TEST(LoopClosures, ScansInARowAreOneAndThoseLeftOutDoNotCount) {
  const auto closures =
      closures_of({{0}, {0.03}, {9, AlignmentOutcome::rejected}, {0.06}, {0.06}, {0.06}, {0.12}, {0.12}});
  ASSERT_EQ(closures.size(), 2U);
  EXPECT_EQ(closures[0].first, "1");
  EXPECT_EQ(closures[0].last, "3");
  EXPECT_DOUBLE_EQ(closures[0].farthest_m, 0.03);
  EXPECT_EQ(closures[1].first, "6");
}

}  // namespace
}  // namespace octosurf::mapper
