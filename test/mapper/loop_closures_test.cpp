// Where a recording's poses stop meeting what was mapped before.
#include "loop_closures.hpp"

#include <gtest/gtest.h>

namespace octosurf::mapper {
namespace {

constexpr double resolution = 0.02;

/// A recording whose scan i is given at the origin and corrected by x m along x.
class Recording {
 public:
  void add(double x, AlignmentOutcome outcome = AlignmentOutcome::corrected) {
    Scan scan;
    scan.name = std::to_string(count_++);
    Alignment alignment;
    alignment.outcome = outcome;
    alignment.T_map_sensor.translation().x() = x;
    closures.add(scan, alignment, resolution);
  }
  LoopClosures closures;

 private:
  int count_ = 0;
};

TEST(LoopClosures, AStepThatLastsIsOne) {
  Recording recording;
  recording.add(0);
  recording.add(0.05);
  recording.add(0.051);
  recording.add(0.052);
  ASSERT_EQ(recording.closures.all().size(), 1U);
  EXPECT_EQ(recording.closures.all()[0].first, "1");
  EXPECT_EQ(recording.closures.all()[0].last, "1");
  EXPECT_DOUBLE_EQ(recording.closures.all()[0].farthest_m, 0.05);
}

TEST(LoopClosures, SoIsOneThatWasFoundAgainByItsPlanes) {
  Recording recording;
  recording.add(0);
  recording.add(0.2, AlignmentOutcome::recovered);
  recording.add(0.2);
  EXPECT_EQ(recording.closures.all().size(), 1U);
}

TEST(LoopClosures, ASingleJumpIsNone) {
  Recording recording;
  recording.add(0.01);
  recording.add(0.2, AlignmentOutcome::recovered);
  recording.add(0.011);  // expected from what was before the jump
  recording.add(0.012);
  EXPECT_TRUE(recording.closures.all().empty());
}

TEST(LoopClosures, NeitherAreStepsBelowAVoxelOrTheLastScan) {
  Recording recording;
  for (int i = 0; i < 50; ++i) recording.add(0.015 * i);
  recording.add(1);
  EXPECT_TRUE(recording.closures.all().empty());
}

TEST(LoopClosures, ScansInARowAreOneAndThoseLeftOutDoNotCount) {
  Recording recording;
  recording.add(0);
  recording.add(0.03);
  recording.add(9, AlignmentOutcome::rejected);
  recording.add(0.06);
  recording.add(0.06);
  recording.add(0.06);
  recording.add(0.12);
  recording.add(0.12);
  ASSERT_EQ(recording.closures.all().size(), 2U);
  EXPECT_EQ(recording.closures.all()[0].first, "1");
  EXPECT_EQ(recording.closures.all()[0].last, "3");
  EXPECT_DOUBLE_EQ(recording.closures.all()[0].farthest_m, 0.03);
  EXPECT_EQ(recording.closures.all()[1].first, "6");
}

}  // namespace
}  // namespace octosurf::mapper
