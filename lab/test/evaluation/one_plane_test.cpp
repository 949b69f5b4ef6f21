#include "evaluation/one_plane.hpp"

#include "evaluation/hand_made.hpp"
#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>

namespace octosurf::evaluation {
namespace {

using namespace hand_made;

const std::vector<Polygon> block{polygon(box(0, 0, 0.4, 0.3))};

/// Two tops of blocks, side by side along x, the second `gap` m behind the first, `step` m higher and turned
/// by `lean` rad about the edge that faces the first.
World blocks(double gap, double step, double lean) {
  World world;
  world.add_face(frame({0, 0, 0}), block);
  world.add_face(frame({0.4 + gap, 0, step}, -lean, Eigen::Vector3d::UnitY()), block);
  return world;
}

const OnePlane rule{radians(0.5), 0.005, 0.08};

std::size_t faces_of(const World& world) { return join_faces(world.truth, rule).faces.size(); }

TEST(OnePlane, BlocksSideBySideAreOneFaceAcrossNoWiderGapStepOrLean) {
  for (const double gap : {0.0, 0.03, 0.079}) EXPECT_EQ(faces_of(blocks(gap, 0, 0)), 1U) << gap;
  EXPECT_EQ(faces_of(blocks(0.081, 0, 0)), 2U) << "farther than h";
  EXPECT_EQ(faces_of(blocks(0.01, 0.0049, 0)), 1U);
  EXPECT_EQ(faces_of(blocks(0.01, 0.0051, 0)), 2U);
  EXPECT_EQ(faces_of(blocks(0.01, 0, radians(0.49))), 1U);
  EXPECT_EQ(faces_of(blocks(0.01, 0, radians(0.51))), 2U);
  EXPECT_EQ(faces_of(blocks(0.01, -0.002, radians(-0.49))), 2U) << "its far side is 5.4 mm down";
}

TEST(OnePlane, AChainOfSmallStepsIsNoPlaneAndWhatIsGoneIsJoinedToNothing) {
  World chain;
  for (int i = 0; i < 5; ++i) chain.add_face(frame({0.41 * i, 0, 0.004 * i}), block);
  EXPECT_EQ(faces_of(chain), 3U) << "two by two, each within 5 mm of the one it begins with";
  World gone = blocks(0.01, 0, 0);
  gone.truth.faces[1].gone = true;
  EXPECT_EQ(faces_of(gone), 2U);
}

TEST(OnePlane, AJoinedFaceHasAllCellsHoweverItsPartsAreTurned) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> turn(-pi, pi);
  for (int round = 0; round < 20; ++round) {
    World world;
    world.add_face(frame({0, 0, 0}), block);
    // The same place beside it, by polygons in a frame that is turned in the plane.
    const Eigen::Isometry3d T = frame({0.41, 0, 0}, turn(random), Eigen::Vector3d::UnitZ());
    Ring2 ring = box(0.41, 0, 0.81, 0.3);
    for (Eigen::Vector2d& uv : ring) uv = (T.inverse() * Eigen::Vector3d(uv.x(), uv.y(), 0)).head<2>();
    world.add_face(T, {polygon(ring)});
    const World moved = world.moved(random_pose(random, 5));
    const Truth joined = join_faces(moved.truth, rule);
    ASSERT_EQ(joined.faces.size(), 1U);
    const TrueFace& face = joined.faces.front();
    EXPECT_EQ(face.joined.size(), 1U);
    // Cells at the edges of either grid differ by half.
    EXPECT_NEAR(face.visible_area_m2, 2 * 0.4 * 0.3, 0.006);
    int cells = 0;
    for (const CellRun& run : face.visible) cells += run.count;
    EXPECT_NEAR(cells * joined.cell * joined.cell, face.visible_area_m2, 1e-9);
  }
}

TEST(OnePlane, ASurfaceOverBlocksIsRightAndItsOutlineIsTheOuterOne) {
  World world = blocks(0.03, 0, 0);
  world.add_surface(frame({0, 0, 0}), {polygon(box(0, 0, 0.83, 0.3))});
  const Json scores = json_of(world);
  expect_in(scores, "faces", 1, "correct", 1, "face_scores/0/joined", Json{2});
  EXPECT_EQ(at(scores, "face_scores").size(), 1U);
  EXPECT_LT(at(scores, "boundary_m/max"), 1e-6) << "sides that face each other are no outline";
}

TEST(OnePlane, SliversSideBySideAreNotJudged) {
  const std::vector<Polygon> sliver{polygon(box(0, 0, 0.4, 0.1))};  // 0.04 m²
  World world;
  for (int i = 0; i < 3; ++i) world.add_face(frame({0, 0.15 * i, 0}), sliver);
  world.add_face(frame({2, 0, 0}), block);
  world.add_surface(frame({2, 0, 0}), block);
  const Json scores = json_of(world);
  expect_in(scores, "faces", 1);
  EXPECT_EQ(at(scores, "face_scores").size(), 2U);
}

TEST(OnePlane, AnUnderSegmentedFaceNamesTheOthersAndHowTheyDiffer) {
  World world = blocks(0.01, 0.003, radians(2));
  world.add_surface(frame({0, 0, 0}), {polygon(box(0, 0, 0.81, 0.3))});
  const Json scores = json_of(world);
  expect_in(scores, "under_segmented", 2);
  ASSERT_EQ(at(scores, "face_scores").size(), 2U);
  for (std::size_t f = 0; f < 2; ++f) {
    const Json& others = at(scores, "face_scores/" + std::to_string(f) + "/fused_with");
    ASSERT_EQ(others.size(), 1U);
    expect_in(others[0], "face", 2 - f, "angle_deg", 2, "offset_m", 0.003 + 0.4 * std::sin(radians(2)));
  }
}

}  // namespace
}  // namespace octosurf::evaluation
