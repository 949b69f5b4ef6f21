#include "evaluation/evaluate.hpp"

#include "hand_made.hpp"

#include <functional>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>

namespace octosurf::evaluation {
namespace {

using namespace hand_made;

const Eigen::Isometry3d ground = frame({0, 0, 0});

Eigen::Isometry3d raised(double height) { return frame({0, 0, height}); }

/// A floor with a hole, a wall and a ramp, all found exactly.
World perfect_world() {
  World world;
  const std::vector<Polygon> floor{polygon(box(0, 0, 2, 1), {box(0.5, 0.3, 0.9, 0.6)})};
  const std::vector<Polygon> wall{polygon(box(0, 0, 2, 1.2))};
  const Eigen::Isometry3d upright = frame({0, 1, 0}, radians(90));
  const Eigen::Isometry3d ramp = frame({3, 0, 0}, radians(11), {0.2, 1, 0});
  for (const auto& [T, polygons] :
       {std::pair(ground, floor), std::pair(upright, wall), std::pair(ramp, wall)}) {
    world.add_face(T, polygons);
    world.add_surface(T, polygons);
  }
  return world;
}

TEST(Evaluate, WhatIsFoundExactlyScoresPerfectly) {
  const Evaluation scores = scores_of(perfect_world());
  EXPECT_EQ(scores.faces, 3u);
  EXPECT_EQ(scores.correct, 3u);
  EXPECT_EQ(scores.over_segmented + scores.under_segmented + scores.missed + scores.noise, 0u);
  EXPECT_DOUBLE_EQ(scores.coverage, 1);
  EXPECT_DOUBLE_EQ(scores.coverage_all, 1);
  EXPECT_DOUBLE_EQ(scores.multiplicity, 1);
  EXPECT_NEAR(scores.visible_m2, 2 - 0.12 + 2 * 2.4, 1e-9);
  EXPECT_NEAR(scores.area_m2, scores.visible_m2, 1e-9);
  EXPECT_EQ(scores.unsafe_m2, 0);
  EXPECT_EQ(scores.ghost_m2, 0);
  EXPECT_EQ(scores.normal_rad.count, 3u);
  EXPECT_NEAR(scores.normal_rad.max, 0, 1e-12);
  EXPECT_NEAR(scores.offset_m.max, 0, 1e-12);
  EXPECT_GT(scores.boundary_m.count, 0u);
  EXPECT_NEAR(scores.boundary_m.max, 0, 1e-9);
  EXPECT_EQ(scores.holes, 1u);
  EXPECT_EQ(scores.holes_found, 1u);
  EXPECT_NEAR(scores.hole_scores.at(0).area_m2, 0.12, 1e-9);
  EXPECT_DOUBLE_EQ(scores.options.tolerance.value(), 0.03);
}

TEST(Evaluate, AnEmptyMapMissesEverything) {
  World world = perfect_world();
  world.snapshot.surfaces.clear();
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.missed, 3u);
  EXPECT_EQ(scores.coverage, 0);
  EXPECT_EQ(scores.multiplicity, 0);
  EXPECT_EQ(scores.unsafe_share, 0);
}

TEST(Evaluate, AFaceInTwoPiecesIsOverSegmented) {
  World world;
  world.add_face(ground, {polygon(box(0, 0, 2, 1))});
  // As far apart as two neighbouring voxels, which both reach half a voxel further.
  world.add_surface(ground, {polygon(box(0, 0, 0.99, 1))});
  world.add_surface(ground, {polygon(box(1.01, 0, 2, 1))});
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.over_segmented, 1u);
  EXPECT_EQ(scores.correct, 0u);
  EXPECT_EQ(scores.noise, 0u);
  EXPECT_DOUBLE_EQ(scores.coverage, 1);
  EXPECT_DOUBLE_EQ(scores.multiplicity, 1);
  EXPECT_EQ(scores.surface_scores.at(0).verdict, FoundVerdict::part);
  EXPECT_EQ(scores.surface_scores.at(1).verdict, FoundVerdict::part);
  EXPECT_EQ(scores.unsafe_m2, 0);
}

TEST(Evaluate, TwoStepsUnderOneSlantedPlaneAreUnderSegmented) {
  World world;
  world.add_face(raised(0), {polygon(box(0, 0, 0.5, 1))});
  world.add_face(raised(0.04), {polygon(box(0.5, 0, 1, 1))});
  // z = 0.02 + 0.06 (x − 0.5): nowhere more than 2 cm off either step, 3.4° steep.
  const double slope = std::atan(0.06);
  world.add_surface(frame({0, 0, -0.01}, -slope, {0, 1, 0}), {polygon(box(0, 0, 1 / std::cos(slope), 1))});
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.under_segmented, 2u);
  EXPECT_EQ(scores.correct, 0u);
  EXPECT_EQ(scores.noise, 0u);
  EXPECT_EQ(scores.surface_scores.at(0).verdict, FoundVerdict::fused);
  EXPECT_DOUBLE_EQ(scores.coverage, 1);
  EXPECT_EQ(scores.unsafe_m2, 0);
}

TEST(Evaluate, AParallelLayerDoublesMultiplicity) {
  World world;
  const std::vector<Polygon> square{polygon(box(0, 0, 1, 1))};
  world.add_face(ground, square);
  world.add_surface(ground, square);
  world.add_surface(raised(0.025), square);
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.correct, 1u);
  EXPECT_EQ(scores.face_scores.at(0).surface, 1u);
  EXPECT_DOUBLE_EQ(scores.multiplicity, 2);
  EXPECT_EQ(scores.noise, 1u);
  EXPECT_EQ(scores.repeated, 1u);
  EXPECT_EQ(scores.unsafe_m2, 0);
}

TEST(Evaluate, ASurfaceOverEmptySpaceIsUnsafe) {
  World world;
  const std::vector<Polygon> square{polygon(box(0, 0, 1, 1))};
  world.add_face(ground, square);
  world.add_surface(ground, square);
  world.add_surface(raised(1), {polygon(box(0, 0, 0.5, 0.4))});
  const Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.unsafe_m2, 0.2, 1e-9);
  EXPECT_NEAR(scores.unsafe_share, 0.2 / 1.2, 1e-9);
  EXPECT_NEAR(scores.surface_scores.at(1).unsafe_m2, 0.2, 1e-9);
  EXPECT_EQ(scores.noise, 1u);
  EXPECT_EQ(scores.repeated, 0u);
  EXPECT_EQ(scores.ghost_m2, 0);
}

TEST(Evaluate, BleedBeyondAnEdgeIsUnsafeFromOneVoxelOn) {
  World world;
  world.add_face(ground, {polygon(box(0, 0, 1, 1))});
  world.add_surface(ground, {polygon(box(0, 0, 1.1, 1))});
  const Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.unsafe_m2, 0.1 - 0.02, 1e-9);
  EXPECT_EQ(scores.correct, 1u);
}

TEST(Evaluate, ATiltedSurfaceStopsCoveringAt15DegreesAndIsUnsafeAt30) {
  for (const auto& [degrees, covers, safe] :
       {std::tuple(14.0, true, true), std::tuple(16.0, false, true), std::tuple(31.0, false, false),
        std::tuple(180.0, false, false)}) {
    SCOPED_TRACE(degrees);
    World world;
    world.add_face(ground, {polygon(box(-0.5, -1, 0.5, 1))});
    // A strip along the axis it is tilted about: within the tolerance all over.
    world.add_surface(frame({0, 0, 0}, radians(degrees), {0, 1, 0}), {polygon(box(-0.03, -1, 0.03, 1))});
    const Evaluation scores = scores_of(world);
    EXPECT_EQ(scores.coverage > 0, covers);
    EXPECT_NEAR(scores.unsafe_m2, safe ? 0 : 0.12, 1e-9);
  }
}

TEST(Evaluate, WhatWasTakenAwayIsGhostAreaUnlessSomethingStandsThere) {
  World world;
  const std::vector<Polygon> square{polygon(box(0, 0, 1, 1))}, top{polygon(box(0, 0, 0.6, 0.5))};
  world.add_face(ground, square);
  world.add_surface(ground, square);
  world.add_face(raised(0.7), top).gone = true;
  world.add_surface(raised(0.7), top);
  Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.ghost_m2, 0.3, 1e-9);
  EXPECT_NEAR(scores.unsafe_m2, 0.3, 1e-9);
  EXPECT_NEAR(scores.false_m2, 0.3, 1e-9);
  EXPECT_EQ(scores.faces, 1u);
  EXPECT_EQ(scores.noise, 1u);

  world.add_face(raised(0.71), top);
  scores = scores_of(world);
  EXPECT_EQ(scores.ghost_m2, 0);
  EXPECT_EQ(scores.unsafe_m2, 0);
  EXPECT_EQ(scores.correct, 2u);
}

TEST(Evaluate, ErrorsAreThoseConstructedWhereverTheWorldLies) {
  for (const double shift : {0.0, 100.0}) {
    SCOPED_TRACE(shift);
    World world;
    // Seen only for u < 1: the errors are measured there, at (0.5, 0.5).
    const std::vector<Polygon> seen{polygon(box(0, 0, 1, 1))};
    world.add_face(ground, {polygon(box(0, 0, 2, 1))}, &seen);
    const Eigen::Isometry3d tilted = frame({0.5, 0.5, 0.005}, radians(0.5), {1, 1, 0});
    world.add_surface(tilted, {polygon(box(-0.5, -0.5, 0.5, 0.5))});
    const Evaluation scores = scores_of(world.moved(frame({shift, -shift, shift})));
    ASSERT_EQ(scores.correct, 1u);
    EXPECT_NEAR(scores.normal_rad.mean, radians(0.5), 1e-9);
    EXPECT_NEAR(scores.offset_m.mean, 0.005 * std::cos(radians(0.5)), 1e-9);
    EXPECT_NEAR(scores.face_scores.at(0).offset_m, -0.005 * std::cos(radians(0.5)), 1e-9);
  }
}

TEST(Evaluate, OnlyTheVisiblePartIsAskedForAndOnlyItsBoundaryMeasured) {
  World world;
  const std::vector<Polygon> seen{polygon(box(0, 0, 1, 1))};
  world.add_face(ground, {polygon(box(0, 0, 2, 1))}, &seen);
  world.add_surface(ground, {polygon(box(0.03, 0.03, 1, 0.97))});
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.correct, 1u);
  EXPECT_NEAR(scores.visible_m2, 1, 1e-9);
  // 3 cm inside three edges; the end of what was seen, 1 m from the face's end, is no boundary.
  EXPECT_NEAR(scores.boundary_m.mean, 0.03, 0.001);
  EXPECT_LT(scores.boundary_m.max, 0.05);
  // From the true edges 300 points; back from the surface's, beyond which the face was seen on, 94 + 2 × 97,
  // and at each corner of its end those that have seen cells within 4 cm aside.
  EXPECT_NEAR(static_cast<double>(scores.boundary_m.count), 300 + 288 + 8, 5);
}

// A floor seen in two patches with 1 m unseen between them, 90 % of what was seen on the left: each patch has
// a surface, and both end where nobody saw on.
TEST(Evaluate, EdgesThatNobodySawAreNotMeasuredAndWrongOnesAre) {
  const std::vector<Polygon> seen{polygon(box(0, 0, 1.8, 1)), polygon(box(2.8, 0, 3, 1))};
  const auto edges = [&seen](std::vector<Ring2> holes, double left_to) {
    World world;
    world.add_face(ground, {polygon(box(0, 0, 3, 1))}, &seen);
    world.add_surface(ground, {polygon(box(0, 0, left_to, 1), std::move(holes))});
    world.add_surface(ground, {polygon(box(2.8, 0, 3, 1))});
    const Evaluation scores = scores_of(world);
    EXPECT_EQ(scores.correct, 1u);
    return scores.boundary_m;
  };
  const Summary right = edges({}, 1.8);
  EXPECT_NEAR(static_cast<double>(right.count), 2 * 180 + 2 * 20 + 2 * 100, 10)
      << "without what lies between";
  EXPECT_LT(right.max, 0.03) << "true edges up to two cells from what was seen count";

  const Summary hole = edges({box(0.8, 0.4, 1, 0.6)}, 1.8);
  EXPECT_NEAR(static_cast<double>(hole.count - right.count), 80, 1) << "the floor was seen in the hole";
  EXPECT_NEAR(hole.max, 0.5, 0.01);
  const Summary early = edges({}, 1.7);
  EXPECT_NEAR(static_cast<double>(early.count - right.count), 100, 5) << "the floor was seen behind that end";
  EXPECT_NEAR(early.max, 0.5, 0.01);
}

// 10 cm beyond an edge that runs 2 mm from the grid's line: columns 3, 13, … 93 mm off it.
TEST(Evaluate, WhatLiesOffTheTrueOutlineIsRimOrFalse) {
  World world;
  world.add_face(ground, {polygon(box(0, 0, 1.002, 1))});
  world.add_surface(ground, {polygon(box(0, 0, 1.1, 1))});
  const Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.unsafe_at(0), 0.09, 1e-9);
  EXPECT_NEAR(scores.unsafe_at(1), 0.08, 1e-9);
  EXPECT_NEAR(scores.rim_m2[0], 0.04, 1e-9) << "13 to 43 mm";
  EXPECT_NEAR(scores.rim_m2[1], 0.03, 1e-9);
  EXPECT_NEAR(scores.false_m2, 0.05, 1e-9) << "53 to 93 mm";
  EXPECT_NEAR(scores.unsafe_m2, 0.08, 1e-9) << "beyond a voxel, as ever";
  EXPECT_EQ(scores.surface_scores.at(0).rim_m2, scores.rim_m2);
  EXPECT_EQ(scores.surface_scores.at(0).false_m2, scores.false_m2);
  const auto json = nlohmann::json::parse(to_json(scores));
  for (const auto& [name, value] :
       {std::pair("unsafe_10mm_m2", 0.09), std::pair("unsafe_10mm_share", 0.09 / 1.1),
        std::pair("rim_10mm_m2", 0.04), std::pair("unsafe_15mm_m2", 0.08),
        std::pair("unsafe_15mm_share", 0.08 / 1.1), std::pair("rim_15mm_m2", 0.03),
        std::pair("false_m2", 0.05), std::pair("false_share", 0.05 / 1.1)})
    EXPECT_NEAR(json.at(name).get<double>(), value, 1e-9) << name;
  EXPECT_NEAR(json.at("surface_scores").at(0).at("rim_15mm_m2").get<double>(), 0.03, 1e-9);
  EXPECT_NEAR(json.at("surface_scores").at(0).at("false_m2").get<double>(), 0.05, 1e-9);
}

TEST(Evaluate, WhatWasHiddenOfAFaceSupports) {
  World world;
  const std::vector<Polygon> seen{polygon(box(0, 0, 1, 1))};
  world.add_face(ground, {polygon(box(0, 0, 2, 1))}, &seen);
  world.add_surface(ground, {polygon(box(0, 0, 2, 1))});
  EXPECT_EQ(scores_of(world).unsafe_at(0), 0);
}

// A pillar's foot, 20 cm wide and 2 mm off the grid's lines, over which the surface runs on.
TEST(Evaluate, WhereSomethingStandsNothingSupports) {
  World world;
  world.add_face(ground, {polygon(box(0, 0, 1, 1), {box(0.402, 0.402, 0.602, 0.602)})});
  world.add_surface(ground, {polygon(box(0, 0, 1, 1))});
  const Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.unsafe_at(0), 0.18 * 0.18, 1e-9);
  EXPECT_NEAR(scores.unsafe_at(1), 0.17 * 0.17, 1e-9);
  EXPECT_NEAR(scores.false_m2, 0.1 * 0.1, 1e-9);
}

TEST(Evaluate, AcrossFlushFacesNothingIsOffAndAboveThemAllIsFalse) {
  World world;
  world.add_face(ground, {polygon(box(0, 0, 1, 1))});
  world.add_face(ground, {polygon(box(1.008, 0, 2, 1))});  // nowhere more than 1 cm from both
  world.add_surface(ground, {polygon(box(0, 0, 2, 1))});
  EXPECT_EQ(scores_of(world).unsafe_at(0), 0);
  world.add_surface(raised(0.04), {polygon(box(0.2, 0.2, 0.7, 0.6))});
  const Evaluation scores = scores_of(world);
  EXPECT_NEAR(scores.false_m2, 0.2, 1e-9);
  EXPECT_EQ(scores.rim_m2[0], 0);
  EXPECT_NEAR(scores.unsafe_at(1), 0.2, 1e-9);
}

TEST(Evaluate, ErrorsOfAllMatchedFacesCountTheOnesNotCorrect) {
  World world;
  const std::vector<Polygon> square{polygon(box(0, 0, 1, 1))};
  world.add_face(ground, square);
  world.add_surface(raised(0.002), square);
  // 60 % of it, tilted by 1° about the line through the seen part's middle, 1 cm up: missed.
  world.add_face(raised(1), square);
  const Eigen::Isometry3d tilted =
      frame({0.5, 0.5, 1.01}) * frame({0, 0, 0}, radians(1), {1, 0, 0}) * frame({-0.5, -0.5, 0});
  world.add_surface(tilted, {polygon(box(0, 0, 0.6, 1))});
  world.add_face(raised(2), square);                          // nothing over it: matched by none
  world.add_face(raised(3), {polygon(box(0, 0, 0.2, 0.2))});  // not judged
  world.add_surface(raised(3.01), {polygon(box(0, 0, 0.2, 0.2))});
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.correct, 1u);
  EXPECT_EQ(scores.missed, 2u);
  EXPECT_EQ(scores.offset_m.count, 1u);
  EXPECT_NEAR(scores.offset_m.max, 0.002, 1e-9);
  EXPECT_EQ(scores.normal_all_rad.count, 2u);
  EXPECT_NEAR(scores.normal_all_rad.max, radians(1), 1e-9);
  EXPECT_NEAR(scores.normal_all_rad.mean, radians(0.5), 1e-9);
  EXPECT_EQ(scores.offset_all_m.count, 2u);
  EXPECT_NEAR(scores.offset_all_m.max, 0.01 * std::cos(radians(1)), 1e-9);
  EXPECT_NEAR(scores.offset_all_m.mean, (0.002 + 0.01 * std::cos(radians(1))) / 2, 1e-9);
}

TEST(Evaluate, AHoleIsFoundIfFourFifthsOfItStayEmpty) {
  const Ring2 hole = box(0.4, 0.4, 0.8, 0.6);
  const auto recall = [&hole](const std::vector<Ring2>& left_open) {
    World world;
    world.add_face(ground, {polygon(box(0, 0, 1, 1), {hole})});
    world.add_surface(ground, {polygon(box(0, 0, 1, 1), left_open)});
    const Evaluation scores = scores_of(world);
    EXPECT_EQ(scores.holes, 1u);
    return std::pair(scores.holes_found, scores.hole_scores.at(0).empty);
  };
  EXPECT_EQ(recall({hole}), std::pair(std::size_t{1}, 1.0));
  EXPECT_EQ(recall({}), std::pair(std::size_t{0}, 0.0));
  EXPECT_EQ(recall({box(0.4, 0.4, 0.74, 0.6)}).first, 1u);
  EXPECT_EQ(recall({box(0.4, 0.4, 0.7, 0.6)}).first, 0u);
  EXPECT_NEAR(recall({box(0.4, 0.4, 0.7, 0.6)}).second, 0.75, 1e-9);
}

TEST(Evaluate, SmallNarrowUnseenAndUncoveredHolesAreNotAskedFor) {
  const auto holes = [](const Ring2& hole, bool seen_around, double covered) {
    World world;
    const std::vector<Polygon> seen{polygon(box(0, 0, seen_around ? 2 : 1, 1), {hole})};
    const std::vector<Polygon> seen_left{polygon(box(0, 0, 1, 1))};
    world.add_face(ground, {polygon(box(0, 0, 2, 1), {hole})}, seen_around ? &seen : &seen_left);
    world.add_surface(ground, {polygon(box(0, 0, covered, 1))});
    return scores_of(world).holes;
  };
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), true, 2), 1u);
  EXPECT_EQ(holes(box(1.3, 0.3, 1.41, 0.41), true, 2), 0u) << "small";
  EXPECT_EQ(holes(box(1.3, 0.1, 1.38, 0.9), true, 2), 0u) << "narrow";
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), false, 2), 0u) << "unseen";
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), true, 1), 0u) << "uncovered";
}

TEST(Evaluate, SmallFacesAreNotJudgedAndTheirSurfacesNoNoise) {
  World world;
  const std::vector<Polygon> square{polygon(box(0, 0, 1, 1))}, small{polygon(box(0, 0, 0.2, 0.2))};
  world.add_face(ground, square);
  world.add_surface(ground, square);
  world.add_face(raised(0.5), small);
  world.add_surface(raised(0.5), {polygon(box(-0.01, -0.02, 0.22, 0.22))});  // 0.055 m²
  world.add_face(raised(1), small);
  const Evaluation scores = scores_of(world);
  EXPECT_EQ(scores.faces, 1u);
  EXPECT_EQ(scores.face_scores.size(), 3u);
  EXPECT_EQ(scores.noise, 0u);
  EXPECT_DOUBLE_EQ(scores.coverage, 1);
  EXPECT_NEAR(scores.coverage_all, 1.04 / 1.08, 1e-9);
}

TEST(Evaluate, ResultsAreWrittenAsJson) {
  World world = perfect_world();
  world.truth.faces[0].name = "bad \xff name";
  const Evaluation scores = scores_of(world);
  const auto json = nlohmann::json::parse(to_json(scores));
  EXPECT_EQ(json.at("correct"), 3);
  EXPECT_EQ(json.at("unsafe_m2"), 0);
  EXPECT_EQ(json.at("options").at("tolerance_m"), 0.03);
  EXPECT_NEAR(json.at("options").at("angle_deg").get<double>(), 15, 1e-9);
  EXPECT_EQ(json.at("normal_deg").at("count"), 3);
  EXPECT_EQ(json.at("face_scores").size(), 3u);
  EXPECT_EQ(json.at("face_scores").at(1).at("verdict"), "correct");
  EXPECT_EQ(json.at("surface_scores").at(2).at("face"), 3);
  EXPECT_EQ(json.at("surface_scores").at(2).at("rim_10mm_m2"), 0);
  EXPECT_EQ(json.at("normal_all_deg").at("count"), 3);
  EXPECT_EQ(json.at("offset_all_m").at("count"), 3);
  EXPECT_EQ(json.at("hole_scores").at(0).at("found"), true);
}

TEST(Summarize, GivesMeanNinetyFifthPercentileAndMaximum) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Summary summary = summarize(values);
  EXPECT_EQ(summary.count, 100u);
  EXPECT_DOUBLE_EQ(summary.mean, 50.5);
  EXPECT_DOUBLE_EQ(summary.p95, 95);
  EXPECT_DOUBLE_EQ(summary.max, 100);
  EXPECT_DOUBLE_EQ(summarize({7}).p95, 7);
  EXPECT_EQ(summarize({}).count, 0u);
}

Error::Kind refusal(const World& world, const EvaluationOptions& options = {}) {
  try {
    evaluate(world.snapshot, world.truth, options);
  } catch (const Error& error) {
    return error.kind();
  }
  ADD_FAILURE() << "not refused";
  return Error::Kind::output;
}

TEST(Evaluate, OptionsOutOfRangeAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using Options = EvaluationOptions;
  const std::vector<std::function<void(Options&)>> spoilers{
      [](Options& o) { o.min_area = -1; },      [nan](Options& o) { o.min_area = nan; },
      [](Options& o) { o.min_area = 100; },     [](Options& o) { o.tolerance = 0; },
      [nan](Options& o) { o.tolerance = nan; }, [](Options& o) { o.angle_rad = 0; },
      [](Options& o) { o.support_rad = 0.1; },  [](Options& o) { o.threshold = 0.5; },
      [](Options& o) { o.threshold = 1.1; },    [](Options& o) { o.grid = 0; }};
  for (const auto& spoil : spoilers) {
    Options options;
    spoil(options);
    EXPECT_EQ(refusal(perfect_world(), options), Error::Kind::usage);
  }
}

TEST(Evaluate, DataThatMakesNoSenseIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto change_surface = [](World& world, const std::function<void(Surface&)>& change) {
    Surface copy = *world.snapshot.surfaces[0];
    change(copy);
    world.snapshot.surfaces[0] = std::make_shared<const Surface>(copy);
  };
  const std::vector<std::function<void(World&)>> spoilers{
      [](World& w) { w.truth.faces.clear(); },
      [](World& w) {
        for (TrueFace& f : w.truth.faces) f.visible.clear();
      },
      [](World& w) {
        for (TrueFace& f : w.truth.faces) f.gone = true;
      },
      [](World& w) { w.truth.cell = 0; },
      [](World& w) { w.snapshot.resolution = 0; },
      [](World& w) { w.truth.faces[0].plane.offset = 0.1; },
      [](World& w) {
        w.truth.faces[0].visible.push_back({3, 5, 1});
      },
      [](World& w) {
        w.truth.faces[0].visible.push_back({300, 5, -1});
      },
      [nan](World& w) { w.truth.faces[0].polygons[0].outer[0].x() = nan; },
      [](World& w) { w.truth.faces[0].polygons[0].outer[2].x() = 1e9; },
      [](World& w) { w.snapshot.surfaces[0] = nullptr; },
      [&](World& w) { change_surface(w, [](Surface& s) { s.plane.normal *= 2; }); },
      [&](World& w) { change_surface(w, [nan](Surface& s) { s.T_map_surface.translation().x() = nan; }); }};
  for (std::size_t i = 0; i < spoilers.size(); ++i) {
    World world = perfect_world();
    spoilers[i](world);
    EXPECT_EQ(refusal(world), Error::Kind::data) << i;
  }
}

}  // namespace
}  // namespace octosurf::evaluation
