#include "footsteps/verify_plan.hpp"
#include "planning/shapes.hpp"
#include "support/painted_octree.hpp"

#include <octosurf/footsteps.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;
using test::verify_plan;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double deg = std::numbers::pi / 180;

Eigen::Isometry3d at(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

/// A level rectangle with its lower left corner there.
Surface slab(SurfaceId id, double x, double y, double z, double length, double width) {
  return surface(id, {{box(0, 0, length, width), {}}}, at(x, y, z));
}

struct Course {
  std::shared_ptr<const Snapshot> snapshot;
  Biped robot;

  FootstepPlan plan(const Standing& from, const Standing& to, const PlanBudget& budget = {}) const {
    FootstepPlanner planner(snapshot, {}, robot);
    const FootstepPlan result = planner.plan(from, to, budget);
    EXPECT_THAT(verify_plan(result, *snapshot, {}, robot), IsEmpty());
    return result;
  }
};

/// A floor of 2 m, `count` treads 0.29 m deep, each `riser` above the one before, and a landing.
Course stair(int count, double riser) {
  std::vector<Surface> surfaces{slab(1, -2, -0.6, 0, 2, 1.2)};
  for (int i = 0; i < count; ++i)
    surfaces.push_back(slab(static_cast<SurfaceId>(i + 2), 0.29 * i, -0.6, riser * (i + 1), 0.29, 1.2));
  surfaces.push_back(slab(50, 0.29 * count, -0.6, riser * (count + 1), 1.5, 1.2));
  return {snapshot_of(surfaces), {}};
}

Course two_floors(double gap) {
  return {snapshot_of({slab(1, -2, -0.6, 0, 2, 1.2), slab(2, gap, -0.6, 0, 2, 1.2)}), {}};
}

std::size_t refused(const FootstepPlan& plan, StepRefusal why) {
  return plan.refusal->refused[static_cast<std::size_t>(why)];
}

TEST(Footsteps, WalkAndTurnOnAFloor) {
  const Course floor{snapshot_of({slab(1, -1, -1, 0, 6, 2)}), {}};
  struct Case {
    const char* what;
    Standing from, to;
    std::size_t least, most;
  };
  for (const Case& c : {Case{"none to where it stands", {{0, 0, 0}, 0}, {{0, 0, 0}, 0}, 0, 0},
                        // 3 m in steps of 0.35 m at most, and one that brings the feet beside each other.
                        Case{"straight on", {{0, 0, 0}, 0}, {{3, 0, 0}, 0}, 9, 12},
                        Case{"on the spot, 22.5° a step", {{0, 0, 0}, 0}, {{0, 0, 0}, 180 * deg}, 8, 30},
                        Case{"turned twice", {{0, 0, 0}, 90 * deg}, {{3, 0, 0}, -90 * deg}, 9, 40}}) {
    SCOPED_TRACE(c.what);
    const FootstepPlan plan = floor.plan(c.from, c.to);
    ASSERT_TRUE(plan.found()) << plan.refusal->sentence;
    EXPECT_GE(plan.steps.size(), c.least);
    EXPECT_LE(plan.steps.size(), c.most);
    if (plan.steps.empty()) continue;
    EXPECT_LE((plan.body.back().at - c.to.at).norm(), 0.2);
    EXPECT_GT(plan.cost, static_cast<double>(plan.steps.size()));
    EXPECT_LE(plan.lower_bound, plan.cost);
    if (c.least == 9) {
      EXPECT_GE(1.5 * plan.lower_bound, plan.cost) << "turning bounds it, too";
    }
  }
}

// A floor seen all over, but for a block of space across it at the height of shins.
TEST(Footsteps, LegsDoNotSwingWhereNobodyLooked) {
  constexpr double d = 0.05;
  test::PaintedOctree octree(d);
  for (int x = -20; x < 80; ++x)
    for (int y = -20; y < 20; ++y)
      for (int z = 0; z < 40; ++z)
        if (!(x >= 26 && x < 32 && z >= 4 && z < 8)) octree.free(x, y, z);
  const auto floor = snapshot_of({slab(1, -1, -1, 0, 5, 2)});
  const Standing from{{0, 0, 0}, 0}, to{{2.5, 0, 0}, 0};
  Biped robot;
  const FootstepPlan stopped = FootstepPlanner(floor, octree.view(), robot).plan(from, to);
  ASSERT_FALSE(stopped.found());
  EXPECT_GT(refused(stopped, StepRefusal::unknown), 0) << stopped.refusal->sentence;
  EXPECT_NEAR(stopped.refusal->nearest->x(), 1.3, 0.3);
  robot.contact.unknown_to_m = 0;
  const FootstepPlan through = FootstepPlanner(floor, octree.view(), robot).plan(from, to);
  ASSERT_TRUE(through.found());
  EXPECT_THAT(verify_plan(through, *floor, octree.view(), robot), IsEmpty());
  robot.contact.unknown_to_m = 0.1;
  EXPECT_THAT(verify_plan(through, *floor, octree.view(), robot), Contains(HasSubstr("unknown space")));
}

TEST(Footsteps, ClimbAStairInTheMiddleOfTreadsAndComeDown) {
  const Course course = stair(5, 0.17);
  const Standing below{{-1, 0, 0}, 0}, above{{0.29 * 5 + 0.6, 0, 0.17 * 6}, 0};
  const FootstepPlan up = course.plan(below, above);
  ASSERT_TRUE(up.found()) << up.refusal->sentence;
  EXPECT_EQ(up.steps.back().surface, 50);
  // In the middle of treads: a sole of 0.22 m has 3.5 cm before and behind it at most, less than
  // StepCosts::good_margin_m.
  std::size_t on_treads = 0;
  for (const Footstep& step : up.steps) {
    if (step.surface == 1 || step.surface == 50) continue;
    ++on_treads;
    EXPECT_NEAR(step.T_map_foot.translation().x(), 0.29 * (static_cast<double>(step.surface) - 1.5), 0.02);
  }
  EXPECT_GE(on_treads, 5U);
  const FootstepPlan down = course.plan({above.at, 180 * deg}, {below.at, 180 * deg});
  ASSERT_TRUE(down.found()) << down.refusal->sentence;
  EXPECT_EQ(down.steps.back().surface, 1);
}

// fixed: 11.25° is as far off the headings of an unturned world as a stair can be; and a world lying on its
// side.
TEST(Footsteps, StandSquareOnTreadsHoweverTheStairIsTurnedAndUpMayBeAnyDirection) {
  for (const auto& [T, yaw] : {std::pair{pose({0, 0, 1}, 11.25 * deg, {0, 0, 0}), 11.25 * deg},
                               std::pair{pose({1, 0, 0}, 90 * deg, {3, -1, 2}), 0.0}}) {
    std::vector<Surface> turned;
    const Course straight = stair(4, 0.17);
    for (const SurfacePtr& tread : straight.snapshot->surfaces)
      turned.push_back(surface(tread->id, tread->polygons, T * tread->T_map_surface));
    Course course{snapshot_of(turned), {}};
    course.robot.contact.up = T.linear().col(2);
    const FootstepPlan plan = course.plan({T * Eigen::Vector3d(-1, 0, 0), yaw},
                                          {T * Eigen::Vector3d(0.29 * 4 + 0.6, 0, 0.17 * 5), yaw});
    EXPECT_TRUE(plan.found()) << plan.refusal->sentence;
  }
}

TEST(Footsteps, CrossStones) {
  std::vector<Surface> surfaces{slab(1, -2, -0.6, 0, 2, 1.2), slab(2, 1.6, -0.6, 0, 2, 1.2)};
  for (int i = 0; i < 5; ++i)
    surfaces.push_back(
        slab(static_cast<SurfaceId>(i + 3), 0.06 + 0.31 * i, i % 2 == 0 ? -0.01 : -0.26, 0.05, 0.27, 0.27));
  const Course course{snapshot_of(surfaces), {}};
  const FootstepPlan plan = course.plan({{-0.8, 0, 0}, 0}, {{2.4, 0, 0}, 0});
  ASSERT_TRUE(plan.found()) << plan.refusal->sentence;
  std::size_t on_stones = 0;
  for (const Footstep& step : plan.steps) on_stones += step.surface >= 3;
  EXPECT_GE(on_stones, 4);
}

TEST(Footsteps, AGapIsSteppedOverOrRefusedForItsWidth) {
  // The toe stands 0.11 + 0.01 m before the edge, the heel as far behind the other: of 0.35 m 0.11 are left.
  const Standing from{{-1, 0, 0}, 0};
  const FootstepPlan over = two_floors(0.08).plan(from, {{1.1, 0, 0}, 0});
  EXPECT_TRUE(over.found()) << over.refusal->sentence;
  const FootstepPlan stopped = two_floors(0.6).plan(from, {{1.6, 0, 0}, 0});
  ASSERT_FALSE(stopped.found());
  EXPECT_EQ(stopped.refusal->why, NoPlan::Why::unreachable);
  EXPECT_GT(refused(stopped, StepRefusal::reach), 0);
  EXPECT_EQ(refused(stopped, StepRefusal::height), 0);
  EXPECT_NEAR(stopped.refusal->nearest->x(), -0.12, 0.1);
  EXPECT_THAT(stopped.refusal->sentence, HasSubstr("(reach)"));
}

TEST(Footsteps, AWallTooHighIsRefusedForItsHeight) {
  const Course course = stair(0, 0.4);
  const FootstepPlan plan = course.plan({{-1, 0, 0}, 0}, {{0.8, 0, 0.4}, 0});
  ASSERT_FALSE(plan.found());
  EXPECT_EQ(plan.refusal->why, NoPlan::Why::unreachable);
  EXPECT_GT(refused(plan, StepRefusal::height), 0);
}

TEST(Footsteps, StartAndGoalAreRefusedWithTheReason) {
  const Course course = two_floors(0.6);
  const FootstepPlan start = course.plan({{0.3, 0, 0}, 0}, {{1.6, 0, 0}, 0});
  ASSERT_FALSE(start.found());
  EXPECT_EQ(start.refusal->why, NoPlan::Why::start);
  EXPECT_THAT(start.refusal->sentence, HasSubstr("no surface"));
  const FootstepPlan goal = course.plan({{-1, 0, 0}, 0}, {{-0.07, 0, 0}, 90 * deg});
  ASSERT_FALSE(goal.found());
  EXPECT_EQ(goal.refusal->why, NoPlan::Why::goal);
  EXPECT_EQ(goal.refusal->contact, ContactRefusal::support) << goal.refusal->sentence;
}

TEST(Footsteps, WhereItCannotStandTheNearestPlaceIsNamed) {
  // Floors up to x = 0 and from 0.6 on. A sole reaches 0.11 m ahead and behind and keeps 0.01 m from edges:
  // of a start at 0.2 m the nearest place is 0.32 m back, or up to two cells farther.
  const Course course = two_floors(0.6);
  const FootstepPlan start = course.plan({{0.2, 0, 0}, 0}, {{1.6, 0, 0}, 0});
  ASSERT_FALSE(start.found());
  ASSERT_TRUE(start.refusal->nearest);
  EXPECT_NEAR(start.refusal->nearest->x(), -0.17, 0.06);
  EXPECT_NEAR(start.refusal->nearest_m, (*start.refusal->nearest - Eigen::Vector3d(0.2, 0, 0)).norm(), 1e-9);
  EXPECT_THAT(start.refusal->sentence, HasSubstr("the nearest place to stand is -0."));
  EXPECT_TRUE(course.plan({*start.refusal->nearest, 0}, {{-1, 0, 0}, 0}).found());

  const FootstepPlan goal = course.plan({{-1, 0, 0}, 0}, {{-1, 5, 0}, 0});
  ASSERT_FALSE(goal.found());
  EXPECT_FALSE(goal.refusal->nearest);
  EXPECT_THAT(goal.refusal->sentence, HasSubstr("no place to stand within 2 m"));
}

TEST(Footsteps, SameBudgetSamePlanWhateverWasPlannedBefore) {
  const Course course = stair(4, 0.17);
  const Standing from{{-1.5, 0.2, 0}, 0}, to{{0.29 * 4 + 0.6, -0.1, 0.17 * 5}, 0};
  FootstepPlanner fresh(course.snapshot, {}, course.robot), used(course.snapshot, {}, course.robot);
  used.plan({{-0.5, 0, 0}, 90 * deg}, {{-1.5, 0, 0}, 45 * deg});
  const FootstepPlan a = fresh.plan(from, to, {5000, 100, {}}), b = used.plan(from, to, {5000, 100, {}});
  ASSERT_TRUE(a.found());
  ASSERT_EQ(a.steps.size(), b.steps.size());
  EXPECT_EQ(a.cost, b.cost);
  for (std::size_t i = 0; i < a.steps.size(); ++i)
    EXPECT_EQ(a.steps[i].T_map_foot.matrix(), b.steps[i].T_map_foot.matrix());
}

TEST(Footsteps, MoreExpansionsNeverMakeAPlanDearer) {
  const Course course = stair(4, 0.17);
  const Standing from{{-1.5, 0.2, 0}, 0}, to{{0.29 * 4 + 0.6, -0.1, 0.17 * 5}, 0};
  double cost = HUGE_VAL;
  for (const std::size_t improving : {0, 100, 1000, 10000}) {
    const FootstepPlan plan = course.plan(from, to, {20000, improving, {}});
    ASSERT_TRUE(plan.found());
    EXPECT_LE(plan.cost, cost);
    EXPECT_LE(plan.lower_bound, plan.cost + 1e-9);
    cost = plan.cost;
  }
}

/// Occupied in a box's voxels.
OccupancyView octree_with(const Eigen::AlignedBox3d& box) {
  constexpr double d = 0.02;
  test::PaintedOctree octree(d);
  const Eigen::Array3i from = (box.min() / d).array().round().cast<int>(),
                       to = (box.max() / d).array().round().cast<int>();
  for (int x = from.x(); x < to.x(); ++x)
    for (int y = from.y(); y < to.y(); ++y)
      for (int z = from.z(); z < to.z(); ++z) octree.occupy(x, y, z, 2, 0);
  return octree.view();
}

/// Of such an octree, in which most is unknown.
Biped of_obstacles_alone() {
  Biped robot;
  robot.contact.unknown_to_m = 0;
  return robot;
}

TEST(Footsteps, GoAroundWhatStandsInTheWayOrHangsOverIt) {
  const Biped robot = of_obstacles_alone();
  const auto floor = snapshot_of({slab(1, -1, -1.5, 0, 4, 3)});
  const Standing from{{-0.5, 0, 0}, 0}, to{{2.2, 0, 0}, 0};
  const FootstepPlan straight = FootstepPlanner(floor, {}, Biped{}).plan(from, to);
  ASSERT_TRUE(straight.found());
  std::optional<FootstepPlanner> kept;
  for (const auto& [low, high] : {std::pair{0.02, 0.3}, {0.3, 0.4}, {1.0, 1.1}}) {
    const OccupancyView octree =
        octree_with({Eigen::Vector3d(0.8, -0.5, low), Eigen::Vector3d(1.0, 0.3, high)});
    const FootstepPlan around = FootstepPlanner(floor, octree, robot).plan(from, to);
    ASSERT_TRUE(around.found()) << around.refusal->sentence;
    EXPECT_THAT(verify_plan(around, *floor, octree, robot), IsEmpty());
    EXPECT_THAT(verify_plan(straight, *floor, octree, robot), Not(IsEmpty())) << "the checker sees " << low;
    EXPECT_GT(around.cost, straight.cost);
    // One that follows finds the same, also where nothing changed.
    for (int k = 0; k < 2; ++k) {
      kept = kept ? kept->next(floor, octree) : FootstepPlanner(floor, octree, robot);
      const FootstepPlan followed = kept->plan(from, to);
      EXPECT_EQ(followed.cost, around.cost);
      EXPECT_EQ(followed.steps.size(), around.steps.size());
    }
  }
}

TEST(Footsteps, TheWayLeadsAroundAWallThatAStepWouldReachOver) {
  // fixed: a step is longer than the wall is thick, so the guide led through it, and 20,000 expansions before
  // it found nothing.
  const Biped robot = of_obstacles_alone();
  const auto floor = snapshot_of({slab(1, 0, -5, 0, 12, 10)});
  const OccupancyView octree = octree_with({Eigen::Vector3d(6, -5, 0.6), Eigen::Vector3d(6.1, 3.5, 0.8)});
  FootstepPlanner planner(floor, octree, robot);
  const FootstepPlan plan = planner.plan({{4, -2, 0}, 0}, {{8, -2, 0}, 0});
  ASSERT_TRUE(plan.found()) << plan.refusal->sentence;
  EXPECT_THAT(verify_plan(plan, *floor, octree, robot), IsEmpty());
}

TEST(Footsteps, AWallAcrossTheWayIsRefusedForItsClearance) {
  const auto floor = snapshot_of({slab(1, -0.4, -0.4, 0, 3.4, 0.8)});
  const OccupancyView octree =
      octree_with({Eigen::Vector3d(0.9, -0.6, 0.02), Eigen::Vector3d(0.94, 0.6, 1.0)});
  FootstepPlanner planner(floor, octree, of_obstacles_alone());
  const FootstepPlan plan = planner.plan({{0, 0, 0}, 0}, {{2.2, 0, 0}, 0});
  ASSERT_FALSE(plan.found());
  EXPECT_LT(plan.refusal->nearest->x(), 0.9);
  EXPECT_GT(refused(plan, StepRefusal::clearance), 0);
}

TEST(VerifyPlan, SeesWhatIsWrong) {
  const Course course = stair(3, 0.17);
  const FootstepPlan good = course.plan({{-1, 0, 0}, 0}, {{0.29 * 3 + 0.6, 0, 0.17 * 4}, 0});
  ASSERT_TRUE(good.found());
  const auto wrong = [&](const auto& spoil) {
    FootstepPlan plan = good;
    spoil(plan);
    return verify_plan(plan, *course.snapshot, {}, course.robot);
  };
  EXPECT_THAT(wrong([](FootstepPlan&) {}), IsEmpty());
  using Spoil = void (*)(FootstepPlan&);
  for (const Spoil spoil :
       {Spoil([](FootstepPlan& plan) { plan.steps[1].foot = plan.steps[0].foot; }),
        Spoil([](FootstepPlan& plan) { plan.steps[2].T_map_foot.translation().z() += 0.01; }),
        Spoil([](FootstepPlan& plan) { plan.steps[2].surface = 999; }),
        Spoil([](FootstepPlan& plan) { plan.steps.erase(plan.steps.begin() + 1, plan.steps.begin() + 3); }),
        Spoil([](FootstepPlan& plan) { plan.steps[3].yaw_rad += 60 * deg; })})
    EXPECT_THAT(wrong(spoil), Not(IsEmpty()));
}

FootstepPlan crawled(const Course& course, const Standing& from, const Standing& to) {
  FootstepPlanner planner(course.snapshot, {}, Quadruped{});
  const FootstepPlan plan = planner.plan(from, to);
  EXPECT_THAT(verify_plan(plan, *course.snapshot, {}, Quadruped{}), IsEmpty());
  return plan;
}

TEST(Crawl, AQuadrupedClimbsAStairAndCrossesASmallGap) {
  const FootstepPlan up = crawled(stair(4, 0.17), {{-1.2, 0, 0}, 0}, {{0.29 * 4 + 0.7, 0, 0.17 * 5}, 0});
  EXPECT_TRUE(up.found()) << up.refusal->sentence;
  const FootstepPlan over = crawled(two_floors(0.1), {{-1.2, 0, 0}, 0}, {{1.2, 0, 0}, 0});
  EXPECT_TRUE(over.found()) << over.refusal->sentence;
  const FootstepPlan stopped = crawled(two_floors(0.6), {{-1.2, 0, 0}, 0}, {{1.7, 0, 0}, 0});
  ASSERT_FALSE(stopped.found());
  EXPECT_GT(refused(stopped, StepRefusal::support), 0) << stopped.refusal->sentence;
}

TEST(Crawl, WhereItCannotStandTheNearestPlaceIsNamed) {
  const auto floors = snapshot_of({slab(1, -3, -1, 0, 3, 2)});
  FootstepPlanner planner(floors, {}, Quadruped{});
  // Its fore feet would be 0.1 m beyond the edge.
  const FootstepPlan plan = planner.plan({{-0.2, 0, 0}, 0}, {{-2, 0, 0}, 0});
  ASSERT_FALSE(plan.found());
  ASSERT_TRUE(plan.refusal->nearest) << plan.refusal->sentence;
  EXPECT_LT(plan.refusal->nearest->x(), -0.2);
  EXPECT_TRUE(planner.plan({*plan.refusal->nearest, 0}, {{-2, 0, 0}, 0}).found());
}

TEST(Crawl, StandsWhereFourFeetDo) {
  const FootstepPlan plan = crawled(two_floors(0.9), {{0.45, 0, 0}, 0}, {{2.0, 0, 0}, 0});
  ASSERT_FALSE(plan.found());
  EXPECT_EQ(plan.refusal->why, NoPlan::Why::start);
}

TEST(Footsteps, WrongUseIsAnError) {
  const Course course = two_floors(0.1);
  Biped robot;
  robot.min_width_m = 0.5;
  EXPECT_THROW(FootstepPlanner(course.snapshot, {}, robot), Error);
  FootstepPlanner planner(course.snapshot, {}, Biped{});
  EXPECT_THROW(planner.plan({{0, NAN, 0}, 0}, {{1, 0, 0}, 0}), Error);
  EXPECT_THROW(planner.plan({{0, 0, 0}, 0}, {{1, 0, 0}, INFINITY}), Error);
}

}  // namespace
}  // namespace octosurf::planning
