// Stairs of known measures are found on maps of their recordings, each kind and each sensor once.
#include "evaluation/stairs.hpp"

#include "accuracy/simulated_map.hpp"
#include "support/paths.hpp"

#include <filesystem>
#include <gtest/gtest.h>
#include <numbers>

#include <octosurf/scan_source.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

void expect_found(const char* scene, const char* sensor, std::size_t frames) {
  simulation::SimulationOptions options;
  options.scene = scene;
  options.sensor = sensor;
  options.frames = frames;  // fewer than a recording has; the steps are seen all the same
  const test::SimulatedMap map(options);
  const Eigen::Vector3d up = up_of(map.mapper.map()).direction;
  const evaluation::StairScores scores =
      evaluation::evaluate_stairs(find_stairs(*map.mapper.snapshot(), up).stairs, map.truth, up);
  ASSERT_EQ(scores.stairs.size(), 1U);
  const evaluation::StairScore& stair = scores.stairs[0];
  EXPECT_GE(stair.seen, 0.7);  // what noses hide of treads is a tenth
  EXPECT_TRUE(stair.pieces == 1 && stair.found == stair.steps)
      << stair.found << " of " << stair.steps << " in " << stair.pieces;
  EXPECT_TRUE(stair.right_kind);
  EXPECT_EQ(scores.invented, 0U);
  // What is wanted of a stair for walking: a centimetre and two degrees, the riser twice as well.
  EXPECT_NEAR(stair.riser_m, 0, 0.005);
  EXPECT_NEAR(stair.tread_m, 0, 0.01);
  EXPECT_NEAR(stair.heading_rad, 0, 2 * std::numbers::pi / 180);
}

TEST(AccuracyOfStairs, AFlightByACamera) { expect_found("flight", "depth", 40); }
TEST(AccuracyOfStairs, OneWithALandingByASpinningLidar) { expect_found("landing", "spinning", 40); }
TEST(AccuracyOfStairs, ASpiralByATiltingLaser) { expect_found("spiral", "tilting", 700); }
TEST(AccuracyOfStairs, AnOpenOneByARealCamera) { expect_found("open", "depth-real", 40); }

// One cloud of many scans, one of them lower at the right. Where the others are alone, the medians of points
// at the middles of its treads, floor and landing rise by 0.166, 0.169, 0.164 and 0.171 m, within 3 mm over
// 0.6 m.
TEST(AccuracyOfStairs, ARealEntranceByItsPoints) {
  const std::filesystem::path cloud =
      std::filesystem::path(test::paths::data()) / "terrain_real/anymal_entrance_stair.pcd";
  if (!std::filesystem::exists(cloud)) GTEST_SKIP() << "no terrain_real";
  for (const double resolution : {0.03, 0.05}) {
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    Mapper mapper(parameters);
    mapper.insert(*open_scans({cloud})->next());
    mapper.drain();
    const std::vector<Stair> stairs = find_stairs(*mapper.snapshot()).stairs;
    ASSERT_EQ(stairs.size(), 1U) << resolution;
    ASSERT_EQ(stairs[0].steps.size(), 4U) << resolution;
    EXPECT_NEAR(stairs[0].riser.mean_m, 0.1675, 0.005) << resolution;
  }
}

}  // namespace
}  // namespace octosurf
