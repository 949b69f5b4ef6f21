#include "evaluation/planar_region.hpp"

#include "evaluation/hand_made.hpp"
#include "evaluation/one_plane.hpp"
#include "hand_made.hpp"

namespace octosurf::evaluation {
namespace {

using namespace hand_made;

/// A star-shaped ring of random radii: simple, concave, no edge along an axis.
Ring2 random_ring(std::mt19937_64& random, const Eigen::Vector2d& centre, double inner, double outer) {
  std::uniform_real_distribution<double> radius(inner, outer);
  Ring2 ring;
  const int corners = 5 + static_cast<int>(random() % 40);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * pi * i / corners;
    ring.push_back(centre + radius(random) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return ring;
}

TEST(PlanarRegion, AgreesWithBruteForceOnRandomPolygonsWithHolesAndIslands) {
  const std::uint64_t seed = test::seed();
  std::mt19937_64 random(seed);
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", round " + std::to_string(round));
    std::uniform_real_distribution<double> within(-5, 5);
    const double x = within(random);
    const Eigen::Vector2d centre(x, within(random));
    const std::vector<Polygon> polygons{
        polygon(random_ring(random, centre, 0.8, 1.3), {random_ring(random, centre, 0.4, 0.7)}),
        polygon(random_ring(random, centre, 0.1, 0.3)),
        polygon(random_ring(random, centre + Eigen::Vector2d(3, 0), 0.2, 1.0))};
    const PlanarRegion region(polygons);
    const test::Region twin(polygons);
    std::uniform_real_distribution<double> u(centre.x() - 2, centre.x() + 5),
        v(centre.y() - 2, centre.y() + 2);
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector2d p(u(random), v(random));
      const double distance = test::distance_to_rings(p, polygons);
      EXPECT_EQ(region.contains(p), twin.covers(p)) << p.transpose();
      EXPECT_NEAR(region.ring_distance(p), distance, 1e-12) << p.transpose();
      EXPECT_EQ(region.within(p, 0.1), twin.covers(p) || distance <= 0.1) << p.transpose();
      EXPECT_EQ(region.ring_distance(p, 0.1) <= 0.1, distance <= 0.1) << p.transpose();
    }
    std::set<std::pair<long, long>> cells;
    region.for_each_cell(0.05, [&](const Eigen::Vector2d& p) {
      cells.emplace(std::lround(p.x() / 0.05 - 0.5), std::lround(p.y() / 0.05 - 0.5));
    });
    std::set<std::pair<long, long>> expected;
    for (long i = -200; i < 300; ++i) {
      for (long j = -200; j < 200; ++j) {
        const Eigen::Vector2d p((double(i) + 0.5) * 0.05, (double(j) + 0.5) * 0.05);
        if ((p - centre).norm() < 6 && twin.covers(p)) expected.emplace(i, j);
      }
    }
    EXPECT_EQ(cells, expected);
  }
}

TEST(PlanarRegion, AFlatRingHasNoInsideButADistance) {
  const PlanarRegion region({polygon({{0, 1}, {1, 1}, {2, 1}})});
  EXPECT_FALSE(region.contains({1, 1}));
  EXPECT_NEAR(region.ring_distance({1, 1.25}), 0.25, 1e-12);
  region.for_each_cell(0.01, [](const Eigen::Vector2d&) { FAIL(); });
}

TEST(PlanarRegion, RingsThatShareAVertexKeepTheirInsides) {
  const PlanarRegion region({polygon(box(0, 0, 1, 1)), polygon(box(1, 1, 2, 2))});
  EXPECT_TRUE(region.contains({0.5, 0.5}));
  EXPECT_TRUE(region.contains({1.5, 1.5}));
  EXPECT_FALSE(region.contains({1.5, 0.5}));
  EXPECT_NEAR(region.ring_distance({1.5, 0.5}), 0.5, 1e-12);
}

TEST(PlanarRegion, PointsOnARingAreSpreadEvenly) {
  std::vector<Eigen::Vector2d> points;
  for_each_on_ring(box(0, 0, 0.03, 0.02), 0.01, [&](const Eigen::Vector2d& p) { points.push_back(p); });
  ASSERT_EQ(points.size(), 10u);
  EXPECT_NEAR((points[0] - Eigen::Vector2d(0.005, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((points[3] - Eigen::Vector2d(0.03, 0.005)).norm(), 0, 1e-12);
  EXPECT_NEAR(enclosed_area(polygon(box(5, 5, 7, 8))), 6, 1e-12);
}

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
