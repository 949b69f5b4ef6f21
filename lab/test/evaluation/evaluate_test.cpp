#include "evaluation/evaluate.hpp"

#include "hand_made.hpp"
#include "simulation/fixture.hpp"

namespace octosurf::evaluation {
namespace {

using namespace hand_made;
using simulation::refusal;

const Eigen::Isometry3d ground = frame({0, 0, 0});

Eigen::Isometry3d raised(double height) { return frame({0, 0, height}); }

std::vector<Polygon> rectangle(double u0, double v0, double u1, double v1, std::vector<Ring2> holes = {}) {
  return {polygon(box(u0, v0, u1, v1), std::move(holes))};
}

const std::vector<Polygon> square = rectangle(0, 0, 1, 1), two_squares = rectangle(0, 0, 2, 1);

/// A face of which all was seen, or `seen`, and a surface in its plane.
World on_ground(const std::vector<Polygon>& face, const std::vector<Polygon>& surface,
                const std::vector<Polygon>* seen = nullptr) {
  World world;
  world.add_face(ground, face, seen);
  world.add_surface(ground, surface);
  return world;
}

/// A floor with a hole, a wall and a ramp, all found exactly.
World perfect_world() {
  World world;
  const std::vector<Polygon> floor = rectangle(0, 0, 2, 1, {box(0.5, 0.3, 0.9, 0.6)}),
                             wall = rectangle(0, 0, 2, 1.2);
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
  World world = perfect_world();
  world.truth.faces[0].name = "bad \xff name";  // names come from files
  const Json scores = json_of(world);
  expect_in(scores, "faces", 3, "correct", 3, "over_segmented", 0, "under_segmented", 0, "missed", 0, "noise",
            0, "coverage", 1, "coverage_all", 1, "multiplicity", 1, "visible_m2", 2 - 0.12 + 2 * 2.4,
            "area_m2", 2 - 0.12 + 2 * 2.4, "unsafe_m2", 0, "ghost_m2", 0);
  expect_in(scores, "normal_deg/count", 3, "normal_deg/max", 0, "normal_all_deg/count", 3, "offset_m/max", 0,
            "offset_all_m/count", 3, "boundary_m/max", 0, "holes", 1, "holes_found", 1,
            "hole_scores/0/area_m2", 0.12, "hole_scores/0/found", true, "face_scores/1/verdict", "correct",
            "surface_scores/2/face", 3, "surface_scores/2/rim_10mm_m2", 0, "options/tolerance_m", 0.03,
            "options/angle_deg", 15);
  EXPECT_GT(at(scores, "boundary_m/count"), 0);
  EXPECT_EQ(scores["face_scores"].size(), 3u);
}

TEST(Evaluate, AnEmptyMapMissesEverything) {
  World world = perfect_world();
  world.snapshot.surfaces.clear();
  expect_scores(world, "missed", 3, "coverage", 0, "multiplicity", 0, "unsafe_share", 0);
}

TEST(Evaluate, AFaceInTwoPiecesIsOverSegmented) {
  // As far apart as two neighbouring voxels, which both reach half a voxel further.
  World world = on_ground(two_squares, rectangle(0, 0, 0.99, 1));
  world.add_surface(ground, rectangle(1.01, 0, 2, 1));
  expect_scores(world, "over_segmented", 1, "correct", 0, "noise", 0, "coverage", 1, "multiplicity", 1,
                "unsafe_m2", 0, "surface_scores/0/verdict", "part", "surface_scores/1/verdict", "part");
}

TEST(Evaluate, TwoStepsUnderOneSlantedPlaneAreUnderSegmented) {
  World world;
  world.add_face(ground, rectangle(0, 0, 0.5, 1));
  world.add_face(raised(0.04), rectangle(0.5, 0, 1, 1));
  // z = 0.02 + 0.06 (x − 0.5): nowhere more than 2 cm off either step, 3.4° steep.
  const double slope = std::atan(0.06);
  world.add_surface(frame({0, 0, -0.01}, -slope, {0, 1, 0}), rectangle(0, 0, 1 / std::cos(slope), 1));
  expect_scores(world, "under_segmented", 2, "correct", 0, "noise", 0, "coverage", 1, "unsafe_m2", 0,
                "surface_scores/0/verdict", "fused");
}

TEST(Evaluate, AKerbThatVanishedInTheFloorIsUnderSegmentedBesideACorrectFloor) {
  World world = on_ground(rectangle(0, 0, 1.9, 1), two_squares);
  world.add_face(raised(0.02), rectangle(1.9, 0, 2, 1));
  expect_scores(world, "correct", 1, "under_segmented", 1, "face_scores/0/verdict", "correct",
                "face_scores/1/verdict", "under-segmented", "surface_scores/0/verdict", "correct");
}

TEST(Evaluate, AParallelLayerDoublesMultiplicityAndASurfaceOverEmptySpaceIsUnsafe) {
  World world = on_ground(square, square);
  world.add_surface(raised(0.025), square);
  expect_scores(world, "correct", 1, "face_scores/0/surface", 1, "multiplicity", 2, "noise", 1, "repeated", 1,
                "unsafe_m2", 0);
  world.add_surface(raised(1), rectangle(0, 0, 0.5, 0.4));
  expect_scores(world, "noise", 2, "repeated", 1, "unsafe_m2", 0.2, "unsafe_share", 0.2 / 2.2,
                "surface_scores/2/unsafe_m2", 0.2, "ghost_m2", 0);
}

TEST(Evaluate, ATiltedSurfaceStopsCoveringAt15DegreesAndIsUnsafeAt30) {
  for (const auto& [degrees, covers, safe] :
       {std::tuple(14.0, true, true), std::tuple(16.0, false, true), std::tuple(31.0, false, false),
        std::tuple(180.0, false, false)}) {
    SCOPED_TRACE(degrees);
    World world;
    world.add_face(ground, rectangle(-0.5, -1, 0.5, 1));
    // A strip along the axis it is tilted about: within the tolerance all over.
    world.add_surface(frame({0, 0, 0}, radians(degrees), {0, 1, 0}), rectangle(-0.03, -1, 0.03, 1));
    EXPECT_EQ(scores_of(world).coverage > 0, covers);
    expect_scores(world, "unsafe_m2", safe ? 0 : 0.12);
  }
}

TEST(Evaluate, WhatWasTakenAwayIsGhostAreaUnlessSomethingStandsThere) {
  const std::vector<Polygon> top = rectangle(0, 0, 0.6, 0.5);
  World world = on_ground(square, square);
  world.add_face(raised(0.7), top).gone = true;
  world.add_surface(raised(0.7), top);
  expect_scores(world, "ghost_m2", 0.3, "unsafe_m2", 0.3, "false_m2", 0.3, "faces", 1, "noise", 1);
  world.add_face(raised(0.71), top);
  expect_scores(world, "ghost_m2", 0, "unsafe_m2", 0, "correct", 2);
}

TEST(Evaluate, ErrorsAreThoseConstructed) {
  World world;
  // Seen only for u < 1: the errors are measured there, at (0.5, 0.5).
  world.add_face(ground, two_squares, &square);
  world.add_surface(frame({0.5, 0.5, 0.005}, radians(0.5), {1, 1, 0}), rectangle(-0.5, -0.5, 0.5, 0.5));
  const double offset = 0.005 * std::cos(radians(0.5));
  expect_scores(world.moved(frame({100, -100, 100})), "correct", 1, "normal_deg/mean", 0.5, "offset_m/mean",
                offset, "face_scores/0/offset_m", -offset);
}

TEST(Evaluate, OnlyTheVisiblePartIsAskedForAndOnlyItsBoundaryMeasured) {
  const Json scores = json_of(on_ground(two_squares, rectangle(0.03, 0.03, 1, 0.97), &square));
  expect_in(scores, "correct", 1, "visible_m2", 1);
  // 3 cm inside three edges; the end of what was seen, 1 m from the face's end, is no boundary.
  EXPECT_NEAR(at(scores, "boundary_m/mean"), 0.03, 0.001);
  EXPECT_LT(at(scores, "boundary_m/max"), 0.05);
  // From the true edges 300 points; back from the surface's, beyond which the face was seen on, 94 + 2 × 97,
  // and at each corner of its end those that have seen cells within 4 cm aside.
  EXPECT_NEAR(at(scores, "boundary_m/count"), 300 + 288 + 8, 5);
}

// A floor seen in two patches with 1 m unseen between them, 90 % of what was seen on the left: each patch has
// a surface, and both end where nobody saw on.
TEST(Evaluate, EdgesThatNobodySawAreNotMeasuredAndWrongOnesAre) {
  const std::vector<Polygon> seen{polygon(box(0, 0, 1.8, 1)), polygon(box(2.8, 0, 3, 1))};
  const auto edges = [&seen](const std::vector<Ring2>& holes, double left_to) {
    World world = on_ground(rectangle(0, 0, 3, 1), rectangle(0, 0, left_to, 1, holes), &seen);
    world.add_surface(ground, rectangle(2.8, 0, 3, 1));
    const Evaluation scores = scores_of(world);
    EXPECT_EQ(scores.correct, 2u) << "each patch is a face";
    return std::pair(static_cast<double>(scores.boundary_m.count), scores.boundary_m.max);
  };
  const auto [right, right_max] = edges({}, 1.8);
  EXPECT_NEAR(right, 2 * 180 + 2 * 20 + 2 * 100, 10) << "without what lies between";
  EXPECT_LT(right_max, 0.03) << "true edges up to two cells from what was seen count";
  const auto [hole, hole_max] = edges({box(0.8, 0.4, 1, 0.6)}, 1.8);
  EXPECT_NEAR(hole - right, 80, 1) << "the floor was seen in the hole";
  EXPECT_NEAR(hole_max, 0.5, 0.01);
  const auto [early, early_max] = edges({}, 1.7);
  EXPECT_NEAR(early - right, 100, 5) << "the floor was seen behind that end";
  EXPECT_NEAR(early_max, 0.5, 0.01);
}

// 10 cm beyond an edge that runs 2 mm from the grid's line: columns 3, 13, … 93 mm off it.
TEST(Evaluate, WhatLiesOffTheTrueOutlineIsRimOrFalse) {
  expect_scores(on_ground(rectangle(0, 0, 1.002, 1), rectangle(0, 0, 1.1, 1)), "unsafe_10mm_m2", 0.09,
                "unsafe_10mm_share", 0.09 / 1.1, "unsafe_15mm_m2", 0.08, "unsafe_15mm_share", 0.08 / 1.1,
                "rim_10mm_m2", 0.04, "rim_15mm_m2", 0.03, "false_m2", 0.05, "false_share", 0.05 / 1.1,
                "surface_scores/0/rim_10mm_m2", 0.04, "surface_scores/0/rim_15mm_m2", 0.03,
                "surface_scores/0/false_m2", 0.05, "unsafe_m2", 0.08, "correct", 1);
}

// A pillar's foot, 20 cm wide and 2 mm off the grid's lines, over which the surface runs on. What was hidden
// of a face supports.
TEST(Evaluate, WhereSomethingStandsNothingSupports) {
  expect_scores(on_ground(rectangle(0, 0, 1, 1, {box(0.402, 0.402, 0.602, 0.602)}), square), "unsafe_10mm_m2",
                0.18 * 0.18, "unsafe_15mm_m2", 0.17 * 0.17, "false_m2", 0.1 * 0.1);
  expect_scores(on_ground(two_squares, two_squares, &square), "unsafe_10mm_m2", 0);
}

TEST(Evaluate, AcrossFlushFacesNothingIsOffAndAboveThemAllIsFalse) {
  World world = on_ground(square, two_squares);
  world.add_face(ground, rectangle(1.008, 0, 2, 1));  // nowhere more than 1 cm from both
  expect_scores(world, "unsafe_10mm_m2", 0);
  world.add_surface(raised(0.04), rectangle(0.2, 0.2, 0.7, 0.6));
  expect_scores(world, "false_m2", 0.2, "rim_10mm_m2", 0, "unsafe_15mm_m2", 0.2);
}

TEST(Evaluate, ErrorsOfAllMatchedFacesCountTheOnesNotCorrect) {
  World world;
  world.add_face(ground, square);
  world.add_surface(raised(0.002), square);
  // 60 % of it, tilted by 1° about the line through the seen part's middle, 1 cm up: missed.
  world.add_face(raised(1), square);
  world.add_surface(frame({0.5, 0.5, 1.01}) * frame({0, 0, 0}, radians(1)) * frame({-0.5, -0.5, 0}),
                    rectangle(0, 0, 0.6, 1));
  world.add_face(raised(2), square);                     // nothing over it: matched by none
  world.add_face(raised(3), rectangle(0, 0, 0.2, 0.2));  // not judged
  world.add_surface(raised(3.01), rectangle(0, 0, 0.2, 0.2));
  const double missed_by = 0.01 * std::cos(radians(1));
  expect_scores(world, "correct", 1, "missed", 2, "offset_m/count", 1, "offset_m/max", 0.002,
                "normal_all_deg/count", 2, "normal_all_deg/max", 1, "normal_all_deg/mean", 0.5,
                "offset_all_m/count", 2, "offset_all_m/max", missed_by, "offset_all_m/mean",
                (0.002 + missed_by) / 2);
}

TEST(Evaluate, AHoleIsFoundIfFourFifthsOfItStayEmpty) {
  const Ring2 hole = box(0.4, 0.4, 0.8, 0.6);
  const auto expect_hole = [&hole](const std::vector<Ring2>& left_open, bool found, double empty) {
    expect_scores(on_ground(rectangle(0, 0, 1, 1, {hole}), rectangle(0, 0, 1, 1, left_open)), "holes", 1,
                  "holes_found", found ? 1 : 0, "hole_scores/0/empty", empty);
  };
  expect_hole({hole}, true, 1);
  expect_hole({}, false, 0);
  expect_hole({box(0.4, 0.4, 0.74, 0.6)}, true, 0.85);
  expect_hole({box(0.4, 0.4, 0.7, 0.6)}, false, 0.75);
}

TEST(Evaluate, SmallNarrowUnseenAndUncoveredHolesAreNotAskedFor) {
  const auto holes = [](const Ring2& hole, bool seen_around, double covered) {
    const std::vector<Polygon> seen = rectangle(0, 0, seen_around ? 2 : 1, 1, {hole});
    return scores_of(on_ground(rectangle(0, 0, 2, 1, {hole}), rectangle(0, 0, covered, 1),
                               seen_around ? &seen : &square))
        .holes;
  };
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), true, 2), 1u);
  EXPECT_EQ(holes(box(1.3, 0.3, 1.41, 0.41), true, 2), 0u) << "small";
  EXPECT_EQ(holes(box(1.3, 0.1, 1.38, 0.9), true, 2), 0u) << "narrow";
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), false, 2), 0u) << "unseen";
  EXPECT_EQ(holes(box(1.3, 0.3, 1.6, 0.6), true, 1), 0u) << "uncovered";
}

TEST(Evaluate, SmallFacesAreNotJudgedAndTheirSurfacesNoNoise) {
  const std::vector<Polygon> small = rectangle(0, 0, 0.2, 0.2), cells_it_meets = rectangle(0, 0, 0.3, 0.3);
  World world = on_ground(square, square);
  world.add_face(raised(0.5), small);
  world.add_surface(raised(0.5), rectangle(-0.01, -0.02, 0.22, 0.22));  // 0.055 m²
  world.add_face(raised(1), small, &cells_it_meets);
  expect_scores(world, "faces", 1, "noise", 0, "coverage", 1, "coverage_all", 1.04 / 1.13, "face_scores/2/id",
                3);
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

TEST(Evaluate, AnAreaThatNoFaceReachesIsRefused) {
  const World world = perfect_world();
  EvaluationOptions options;
  options.min_area = 100;
  refusal(Error::Kind::usage, [&] { evaluate(world.snapshot, world.truth, options); });
}

TEST(Evaluate, DataThatMakesNoSenseIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto change = [](World& world, const std::function<void(Surface&)>& spoil) {
    Surface copy = *world.snapshot.surfaces[0];
    spoil(copy);
    world.snapshot.surfaces[0] = std::make_shared<const Surface>(copy);
  };
  const std::vector<std::function<void(World&)>> spoilers{
      [](World& w) { w.truth.faces.clear(); },
      [](World& w) { std::ranges::for_each(w.truth.faces, [](TrueFace& f) { f.visible.clear(); }); },
      [](World& w) { std::ranges::for_each(w.truth.faces, [](TrueFace& f) { f.gone = true; }); },
      [](World& w) { w.truth.cell = 0; },
      [](World& w) { w.snapshot.resolution = 0; },
      [](World& w) { w.truth.faces[0].plane.offset = 0.1; },
      [](World& w) {
        w.truth.faces[0].visible.push_back(CellRun{3, 5, 1});
      },
      [](World& w) {
        w.truth.faces[0].visible.push_back(CellRun{300, 5, -1});
      },
      [nan](World& w) { w.truth.faces[0].polygons[0].outer[0].x() = nan; },
      [](World& w) { w.truth.faces[0].polygons[0].outer[2].x() = 1e9; },
      [](World& w) { w.snapshot.surfaces[0] = nullptr; },
      [&](World& w) { change(w, [](Surface& s) { s.plane.normal *= 2; }); },
      [&](World& w) { change(w, [nan](Surface& s) { s.T_map_surface.translation().x() = nan; }); }};
  for (std::size_t i = 0; i < spoilers.size(); ++i) {
    SCOPED_TRACE(i);
    World world = perfect_world();
    spoilers[i](world);
    refusal(Error::Kind::data, [&] { scores_of(world); });
  }
}

/// Faces and, near them, surfaces that miss them by a little in every way.
World random_world(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  World world;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Isometry3d T = random_pose(random, 0.8);
    world.add_face(T, {polygon(box(0, 0, 0.3 + unit(random), 0.3 + unit(random)))}).gone = i == 5;
    for (int k = 0; k < 2; ++k) {
      const double u = 0.4 * unit(random), v = 0.4 * unit(random);
      const Eigen::Isometry3d tilt = frame({0, 0, 0.06 * unit(random) - 0.03}, radians(20 * unit(random)),
                                           {unit(random), unit(random), 0.1});
      world.add_surface(T * tilt, {polygon(box(u, v, u + 0.2 + unit(random), v + 0.2 + unit(random)))});
    }
  }
  return world;
}

double angle_between(const Plane& a, const Plane& b) {
  return std::acos(std::min(1.0, a.normal.dot(b.normal)));
}

/// Of `p` to the polygons in their plane, 0 within them; infinite if it is more than 3 cm off the plane.
double distance_in_plane(const Eigen::Vector3d& p, const Plane& plane, const Eigen::Isometry3d& T,
                         const std::vector<Polygon>& polygons) {
  if (std::abs(plane.signed_distance(p)) > 0.03) return std::numeric_limits<double>::infinity();
  const Eigen::Vector2d uv = (T.inverse() * p).head<2>();
  return test::Region(polygons).covers(uv) ? 0 : test::distance_to_rings(uv, polygons);
}

/// Calls visit(p) for the middle of each cell of 1 cm, in the map's frame.
template <class Visit>
void for_each_middle(const std::vector<CellRun>& runs, const Eigen::Isometry3d& T, const Visit& visit) {
  for (const CellRun& run : runs)
    for (int c = run.column; c < run.column + run.count; ++c)
      visit(Eigen::Vector3d(T * Eigen::Vector3d((c + 0.5) / 100, (run.row + 0.5) / 100, 0)));
}

TEST(EvaluateProperties, AgreesWithBruteForceOnRandomWorlds) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 random(seed);
  double ghosts = 0;
  for (int round = 0; round < 3; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    const World world = random_world(random);
    double cells = 0, covered = 0, layers = 0, samples = 0, unsafe = 0, ghost = 0;
    double off_10mm = 0, off_15mm = 0, off_50mm = 0;
    for (const TrueFace& face : world.truth.faces) {
      if (face.gone) continue;
      for_each_middle(face.visible, face.T_map_face, [&](const Eigen::Vector3d& p) {
        int n = 0;
        for (const SurfacePtr& s : world.snapshot.surfaces)
          n += angle_between(s->plane, face.plane) <= radians(15) &&
               distance_in_plane(p, s->plane, s->T_map_surface, s->polygons) <= 0.01;
        ++cells;
        covered += n > 0;
        layers += n;
      });
    }
    for (const SurfacePtr& s : world.snapshot.surfaces) {
      for_each_middle(cells_inside(s->polygons, 0.01), s->T_map_surface, [&](const Eigen::Vector3d& p) {
        double off = std::numeric_limits<double>::infinity(), off_gone = off;
        for (const TrueFace& face : world.truth.faces) {
          if (angle_between(s->plane, face.plane) > radians(30)) continue;
          double& nearest = face.gone ? off_gone : off;
          nearest = std::min(nearest, distance_in_plane(p, face.plane, face.T_map_face, face.polygons));
        }
        ++samples;
        unsafe += off > 0.02;
        ghost += off > 0.02 && off_gone <= 0.02;
        off_10mm += off > 0.01;
        off_15mm += off > 0.015;
        off_50mm += off > 0.05;
      });
    }
    expect_scores(world, "coverage", covered / cells, "multiplicity", layers / covered, "area_m2",
                  samples / 1e4, "unsafe_m2", unsafe / 1e4, "ghost_m2", ghost / 1e4, "unsafe_10mm_m2",
                  off_10mm / 1e4, "unsafe_15mm_m2", off_15mm / 1e4, "false_m2", off_50mm / 1e4);
    EXPECT_GT(off_10mm, off_15mm);
    EXPECT_GT(off_15mm, off_50mm);
    EXPECT_GT(off_50mm, 0);
    EXPECT_LT(covered, cells);
    ghosts += ghost;
  }
  EXPECT_GT(ghosts, 0);  // in one world of a hundred both surfaces miss the face that is gone
}

}  // namespace
}  // namespace octosurf::evaluation
