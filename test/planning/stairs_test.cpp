// Stairs from outlines made by hand, in a map that is turned and shifted.
#include "planning/shapes.hpp"

#include <octosurf/stairs.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double degree = std::numbers::pi / 180;

/// Level surfaces in a world that leans: no axis of the map is special.
class Place {
 public:
  Place() {
    T_map_upright_.linear() = upright(up).conjugate().toRotationMatrix();
    T_map_upright_.translation() = Eigen::Vector3d(3, -2, 1);
  }
  /// A rectangle with its lower left corner at (x, y), turned by `yaw` about the vertical through (0, 0).
  SurfaceId add(double x, double y, double width, double depth, double z, double yaw = 0) {
    return add(Ring2{{x, y}, {x + width, y}, {x + width, y + depth}, {x, y + depth}}, z, yaw);
  }
  SurfaceId add(Ring2 ring, double z, double yaw = 0) {
    const Eigen::Isometry3d T =
        T_map_upright_ * Eigen::Translation3d(0, 0, z) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
    snapshot.surfaces.push_back(
        std::make_shared<const Surface>(shapes::surface(next_++, {{std::move(ring), {}}}, T)));
    return next_ - 1;
  }
  /// Floor, `treads` and a landing, 1.2 m wide, rising along y from y = 0.
  void add_flight(int treads, double riser, double tread, double yaw = 0, double nosing = 0) {
    add(-3, -3, 6, 3 + nosing, 0, yaw);
    for (int k = 0; k < treads; ++k) add(-0.6, k * tread, 1.2, tread + nosing, (k + 1) * riser, yaw);
    add(-0.6, treads * tread, 1.2, 1.4, (treads + 1) * riser, yaw);
  }
  Stairs find() const { return find_stairs(snapshot, up); }

  Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.2, 1).normalized();
  Snapshot snapshot;

 private:
  Eigen::Isometry3d T_map_upright_ = Eigen::Isometry3d::Identity();
  SurfaceId next_ = 1;
};

TEST(Stairs, AStraightFlightHasItsMeasures) {
  for (const int treads : {2, 5, 13})
    for (const double riser : {0.10, 0.17, 0.22})
      for (const double nosing : {0.0, 0.03}) {
        Place place;
        place.add_flight(treads, riser, 0.29, 35 * degree, nosing);
        const Stairs found = place.find();
        ASSERT_EQ(found.stairs.size(), 1U) << treads << " of " << riser;
        const Stair& stair = found.stairs[0];
        EXPECT_EQ(stair.id, 2U);
        EXPECT_EQ(stair.kind, StairKind::straight);
        EXPECT_EQ(stair.steps.size(), static_cast<std::size_t>(treads + 1));
        EXPECT_EQ(stair.treads.size(), static_cast<std::size_t>(treads));
        EXPECT_TRUE(std::is_sorted(stair.treads.begin(), stair.treads.end()));
        EXPECT_EQ(stair.landing_below, 1U);
        EXPECT_EQ(stair.landing_above, static_cast<SurfaceId>(treads + 2));
        EXPECT_NEAR(stair.riser.mean_m, riser, 1e-6);
        EXPECT_NEAR(stair.riser.std_m, 0, 1e-6);
        EXPECT_NEAR(stair.tread.mean_m, 0.29, 0.002);
        EXPECT_NEAR(stair.width_m, 1.2, 0.05);
        EXPECT_NEAR(stair.heading_rad, 125 * degree, 0.2 * degree);
        EXPECT_NEAR(stair.turn_rad, 0, 0.5 * degree);
        EXPECT_THAT(found.single_steps, IsEmpty());
      }
}

TEST(Stairs, APartOfAStairGrowsAndKeepsItsId) {
  Place place;
  place.add(-0.6, 0.29, 1.2, 0.29, 0.34);  // 1: the second tread, seen first
  place.add(-0.6, 0, 1.2, 0.29, 0.17);
  EXPECT_THAT(place.find().stairs, IsEmpty()) << "one riser is no stair";
  EXPECT_EQ(place.find().single_steps.size(), 1U);
  for (int k = 2; k < 6; ++k) {
    place.add(-0.6, k * 0.29, 1.2, 0.29, (k + 1) * 0.17);
    const Stairs found = place.find();
    ASSERT_EQ(found.stairs.size(), 1U);
    EXPECT_EQ(found.stairs[0].id, 1U);
    EXPECT_EQ(found.stairs[0].steps.size(), static_cast<std::size_t>(k));
    EXPECT_THAT(found.single_steps, IsEmpty());
  }
}

TEST(Stairs, AMergedTreadKeepsTheStairsId) {
  Place place;
  place.add_flight(4, 0.17, 0.29);
  place.snapshot.removals = RemovalLog().with({{Removal::Of::surface, 2, 9, 1, 5, {}}});
  Surface merged = *place.snapshot.surfaces[1];
  merged.id = 9;
  merged.parents = {2};
  place.snapshot.surfaces.erase(place.snapshot.surfaces.begin() + 1);
  place.snapshot.surfaces.push_back(std::make_shared<const Surface>(merged));
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  EXPECT_EQ(found.stairs[0].id, 2U);
  EXPECT_THAT(found.stairs[0].treads, ElementsAre(9, 3, 4, 5));
}

TEST(Stairs, TreadsMappedInPartsAreOneStair) {
  Place place;
  place.add(-3, -3, 6, 3, 0);
  for (int k = 0; k < 4; ++k) {
    // Side by side, a worn tread's left and right a little lower and farther back; the third whole.
    const double y = k * 0.29, z = (k + 1) * 0.17, middle = k % 2 == 0 ? 0.1 : -0.15;
    if (k == 2) {
      place.add(-0.6, y, 1.2, 0.29, z);
      continue;
    }
    place.add(-0.6, y, 0.6 + middle - 0.01, 0.29, z);
    place.add(middle, y + 0.02, 0.6 - middle, 0.29, z - 0.01);
  }
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  const Stair& stair = found.stairs[0];
  EXPECT_EQ(stair.steps.size(), 4U);
  EXPECT_THAT(stair.treads, testing::UnorderedElementsAre(2, 3, 4, 5, 6, 7, 8));
  EXPECT_EQ(stair.landing_below, 1U);
  EXPECT_NEAR(stair.riser.mean_m, 0.17, 0.005);
  EXPECT_NEAR(stair.width_m, 1.2, 0.05);
  EXPECT_NEAR(stair.tread.mean_m, 0.29, 0.01);
  EXPECT_THAT(found.single_steps, IsEmpty());
}

TEST(Stairs, OneThatTurnsBackAtALandingIsOne) {
  Place place;
  place.add(-3, -3, 6, 3, 0);
  for (int k = 0; k < 4; ++k) place.add(0, k * 0.28, 1.0, 0.28, (k + 1) * 0.18);
  place.add(0, 4 * 0.28, 2.1, 1.0, 5 * 0.18);
  for (int k = 0; k < 4; ++k) place.add(1.1, (3 - k) * 0.28, 1.0, 0.28, (k + 6) * 0.18);
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  const Stair& stair = found.stairs[0];
  EXPECT_EQ(stair.kind, StairKind::turning);
  EXPECT_EQ(stair.steps.size(), 9U);
  EXPECT_THAT(stair.treads, ElementsAre(2, 3, 4, 5, 6, 7, 8, 9, 10));
  EXPECT_NEAR(stair.riser.mean_m, 0.18, 1e-6);
  EXPECT_NEAR(stair.tread.mean_m, 0.28, 0.002) << "the landing is no tread";
  EXPECT_NEAR(std::fabs(stair.turn_rad), std::numbers::pi, 1 * degree);
}

TEST(Stairs, ASpiralTurnsOnEveryTread) {
  constexpr double turn = 24 * degree, inner = 0.25, outer = 1.25;
  Place place;
  for (int k = 0; k < 9; ++k) {
    const auto at = [&](double radius, double angle) {
      return Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle));
    };
    place.add(
        Ring2{at(inner, k * turn), at(outer, k * turn), at(outer, (k + 1) * turn), at(inner, (k + 1) * turn)},
        k * 0.19);
  }
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  const Stair& stair = found.stairs[0];
  EXPECT_EQ(stair.kind, StairKind::spiral);
  EXPECT_EQ(stair.steps.size(), 8U);
  EXPECT_NEAR(stair.turn_rad, 7 * turn, 2 * degree);
  // The chord at the middle of the edges, which lies within where the narrow ends are too short to be found.
  EXPECT_NEAR(stair.tread.mean_m, 2 * 0.75 * std::sin(turn / 2), 0.06);
}

TEST(Stairs, OpenTreadsOverAFloorAreOne) {
  Place place;
  place.add(-3, -3, 6, 6, 0);  // goes on below the treads
  for (int k = 0; k < 6; ++k) place.add(-0.45, k * 0.25, 0.9, 0.28, (k + 1) * 0.14);
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  EXPECT_EQ(found.stairs[0].steps.size(), 6U);
  EXPECT_EQ(found.stairs[0].landing_below, 1U);
  EXPECT_NEAR(found.stairs[0].tread.mean_m, 0.25, 0.002);
}

TEST(Stairs, ShelvesBoxesAndKerbsAreNone) {
  Place shelves;
  shelves.add(-3, -3, 6, 6, 0);
  for (int k = 1; k < 7; ++k) shelves.add(0, 0, 1, 0.35, k * 0.25);
  EXPECT_THAT(shelves.find().stairs, IsEmpty());
  Place boxes;  // a row of boxes on a floor, as high as a stair's treads, and two stacks
  boxes.add(-3, -3, 9, 6, 0);
  for (int k = 0; k < 5; ++k) boxes.add(k * 0.8, 0, 0.5, 0.4, 0.2);
  boxes.add(0.05, 0.05, 0.4, 0.3, 0.4);
  boxes.add(0.1, 0.1, 0.3, 0.2, 0.6);
  EXPECT_THAT(boxes.find().stairs, IsEmpty());
  Place kerb;
  kerb.add(-3, -3, 6, 3, 0);
  kerb.add(-3, 0, 6, 2, 0.12);
  const Stairs found = kerb.find();
  EXPECT_THAT(found.stairs, IsEmpty());
  ASSERT_EQ(found.single_steps.size(), 1U);
  EXPECT_NEAR(found.single_steps[0].riser_m, 0.12, 1e-6);
  EXPECT_NEAR(found.single_steps[0].width_m, 6, 0.1);
}

TEST(Stairs, TwoRisersCountWhereABuilderMadeThem) {
  for (const double more : {0.0, 0.008, 0.02}) {
    Place stones;
    stones.add(-3, -3, 6, 6, 0);
    stones.add(0, 0, 0.5, 0.5, 0.14);
    stones.add(0, 0.5, 0.5, 0.5, 0.28 + more);
    EXPECT_EQ(stones.find().stairs.size(), more > 0.01 ? 0U : 1U) << more;
  }
  Place tilted;  // one of the stones by 4° about its front edge
  tilted.add(-3, -3, 6, 6, 0);
  tilted.add(0, 0, 0.5, 0.5, 0.14);
  tilted.add(0, 0.5, 0.5, 0.5, 0.28);
  const Surface& stone = *tilted.snapshot.surfaces.back();
  const Eigen::Isometry3d T = stone.T_map_surface * Eigen::Translation3d(0, 0.5, 0) *
                              Eigen::AngleAxisd(4 * degree, Eigen::Vector3d::UnitX()) *
                              Eigen::Translation3d(0, -0.5, 0);
  tilted.snapshot.surfaces.back() =
      std::make_shared<const Surface>(shapes::surface(stone.id, stone.polygons, T));
  EXPECT_THAT(tilted.find().stairs, IsEmpty());
}

TEST(Stairs, RisersAreWhatFeetClimbHoweverTreadsLean) {
  Place place;
  place.add_flight(4, 0.17, 0.29);
  for (std::size_t k = 1; k < 5; ++k) {  // about their middles, as worn fronts lean them
    SurfacePtr& tread = place.snapshot.surfaces[k];
    const Eigen::Translation3d middle(0, (static_cast<double>(k) - 0.5) * 0.29, 0);
    tread = std::make_shared<const Surface>(
        shapes::surface(tread->id, tread->polygons,
                        tread->T_map_surface * middle *
                            Eigen::AngleAxisd(5 * degree, Eigen::Vector3d::UnitX()) * middle.inverse()));
  }
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 1U);
  for (const Step& step : found.stairs[0].steps) EXPECT_NEAR(step.riser_m, 0.17, 0.003);
}

TEST(Stairs, TwoBesideEachOtherAreTwo) {
  Place place;
  place.add(-3, -3, 6, 3, 0);
  for (const double x : {-1.5, 0.2})
    for (int k = 0; k < 5; ++k) place.add(x, k * 0.3, 1.2, 0.3, (k + 1) * 0.16);
  const Stairs found = place.find();
  ASSERT_EQ(found.stairs.size(), 2U);
  EXPECT_THAT(found.stairs[0].treads, ElementsAre(2, 3, 4, 5, 6));
  EXPECT_THAT(found.stairs[1].treads, ElementsAre(7, 8, 9, 10, 11));
}

TEST(Stairs, AreNamedByTheirOldestTread) {
  Place place;
  place.add(0, 0, 1, 1, 0);  // 1 was elsewhere
  place.snapshot.surfaces.clear();
  place.add(-3, -3, 6, 3.29, 0.34);                                                   // 2: the lower floor
  for (int k = 1; k < 5; ++k) place.add(-0.6, k * 0.29, 1.2, 0.29, 0.34 + k * 0.17);  // 3 to 6
  const std::vector<Stair> before = place.find().stairs;
  ASSERT_EQ(before.size(), 1U);
  EXPECT_EQ(before[0].id, 3U);
  // An older surface joins at the upper end.
  const Surface& last = *place.snapshot.surfaces.back();  // its frame is the upright one
  place.snapshot.surfaces.insert(
      place.snapshot.surfaces.begin(),
      std::make_shared<const Surface>(
          shapes::surface(1, last.polygons, last.T_map_surface * Eigen::Translation3d(0, 0.29, 0.17))));
  const std::vector<Stair> now = place.find().stairs;
  ASSERT_EQ(now.size(), 1U);
  EXPECT_EQ(now[0].id, 1U);
}

TEST(Stairs, TheNearestIsTold) {
  Place place;
  place.add_flight(4, 0.17, 0.29);
  const Stairs found = place.find();
  EXPECT_EQ(nearest_stair(place.snapshot, found.stairs, {3, -2, 1}), found.stairs.data());
  EXPECT_EQ(nearest_stair(place.snapshot, {}, {3, -2, 1}), nullptr);
  EXPECT_THROW(find_stairs(place.snapshot, Eigen::Vector3d::Zero()), Error);
}

}  // namespace
}  // namespace octosurf
