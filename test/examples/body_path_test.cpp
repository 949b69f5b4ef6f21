// A body's path over a mapped stair, against the scene as it is.
#include "body_path.hpp"

#include "evaluation/planar_region.hpp"
#include "simulation/recording.hpp"
#include "support/seed.hpp"

#include <algorithm>
#include <cmath>
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include <octosurf/adapters/octree.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::examples {
namespace {

constexpr double between_points = 0.02;  // m, of the true faces' samples
constexpr double touch = 0.01;           // m: so deep in the body is a touch, half of what it keeps away

Eigen::Vector3d middle_of(const evaluation::TrueFace& face) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : face.polygons)
    for (const Eigen::Vector2d& uv : polygon.outer) box.extend(uv);
  return face.T_map_face * Eigen::Vector3d(box.center().x(), box.center().y(), 0);
}

/// The scene `stairs`, mapped; a place on the floor before the stair and one on its landing.
class MappedStair {
 public:
  MappedStair() {
    simulation::SimulationOptions options;
    options.scene = "stairs";
    options.seed = test::seed();
    options.frames = 80;
    const simulation::Recording recording(options);
    Parameters coarse;
    coarse.occupancy.resolution = 0.03;
    Mapper mapper(coarse);
    for (std::size_t i = 0; i < recording.size(); ++i) mapper.insert(recording.scan(i));
    snapshot = mapper.snapshot();
    octree = mapper.map().octree();
    std::vector<const evaluation::TrueFace*> treads;
    for (const evaluation::TrueFace& face : recording.faces()) {
      evaluation::PlanarRegion(face.polygons).for_each_cell(between_points, [&](const Eigen::Vector2d& uv) {
        points.push_back(face.T_map_face * Eigen::Vector3d(uv.x(), uv.y(), 0));
      });
      if (face.name.starts_with("stair") && face.plane.normal.z() > 0.99) treads.push_back(&face);
    }
    std::sort(treads.begin(), treads.end(), [](const evaluation::TrueFace* a, const evaluation::TrueFace* b) {
      return middle_of(*a).z() < middle_of(*b).z();
    });
    const Eigen::Vector3d first = middle_of(*treads.at(0)), second = middle_of(*treads.at(1));
    const Eigen::Vector3d ahead = (second - first).cwiseProduct(Eigen::Vector3d(1, 1, 0)).normalized();
    const Eigen::Vector3d below = first - 0.9 * ahead, above = middle_of(*treads.back());
    landing_z = above.z();
    const double yaw = std::atan2(ahead.y(), ahead.x());
    from = {below.x(), below.y(), yaw + 2};  // so that it has to turn first
    to = {above.x(), above.y(), yaw};
  }

  std::shared_ptr<const Snapshot> snapshot;
  OccupancyView octree;
  std::vector<Eigen::Vector3d> points;  ///< of all true faces
  BodyState from, to;
  double landing_z = 0;
};

const MappedStair& stair() {
  static const MappedStair mapped;
  return mapped;
}

/// A true point lies in the body by more than `touch`.
bool touches(const Eigen::Isometry3d& T_map_body, const Body& body) {
  const Eigen::Vector3d middle(0, 0, (body.from_m + body.to_m) / 2);
  const Eigen::Vector3d half(body.length_m / 2 - touch, body.width_m / 2 - touch,
                             (body.to_m - body.from_m) / 2 - touch);
  const Eigen::Isometry3d T_body_map = T_map_body.inverse();
  return std::any_of(stair().points.begin(), stair().points.end(), [&](const Eigen::Vector3d& point) {
    return ((T_body_map * point - middle).cwiseAbs().array() < half.array()).all();
  });
}

TEST(BodyPath, ClimbsTheStairAndTouchesNothing) {
  const Body body;
  const BodyPlanner planner(*stair().snapshot, stair().octree, body);
  const BodyPath path = planner.plan(stair().from, stair().to, static_cast<std::uint32_t>(test::seed()));
  ASSERT_FALSE(path.states.empty()) << path.refusal;
  ASSERT_EQ(path.poses.size(), path.states.size());
  const auto near = [](const BodyState& a, const BodyState& b, double m) {
    return std::hypot(a.x - b.x, a.y - b.y) < m &&
           std::abs(std::remainder(a.yaw_rad - b.yaw_rad, 2 * std::numbers::pi)) < 0.1;
  };
  EXPECT_TRUE(near(path.states.front(), stair().from, 1e-6));
  EXPECT_TRUE(near(path.states.back(), stair().to, 1e-6));
  EXPECT_NEAR(path.poses.back().translation().z(), stair().landing_z, 0.03);
  for (std::size_t i = 0; i < path.poses.size(); ++i) {
    ASSERT_TRUE(i == 0 || near(path.states[i - 1], path.states[i], 0.03)) << i;
    ASSERT_FALSE(touches(path.poses[i], body)) << i;
  }
}

TEST(BodyPath, OfAWallIsATouch) {  // what the test above asks can fail
  Eigen::Isometry3d in_a_face = Eigen::Isometry3d::Identity();
  in_a_face.translation() = stair().points.front();
  EXPECT_TRUE(touches(in_a_face * Eigen::Translation3d(0, 0, -0.4), Body{}));
}

TEST(BodyPath, IsRefusedWhereLegsAreTooShortForTheRisers) {
  Body body;
  body.max_rise_m = 0.10;  // risers are 0.17 m
  const BodyPlanner planner(*stair().snapshot, stair().octree, body);
  ASSERT_TRUE(planner.stands(stair().from));
  ASSERT_TRUE(planner.stands(stair().to));
  const BodyPath path = planner.plan(stair().from, stair().to, static_cast<std::uint32_t>(test::seed()), 500);
  EXPECT_TRUE(path.states.empty());
  EXPECT_EQ(path.refusal, "no path in 500 iterations");
}

TEST(BodyPath, IsRefusedToWhereTheBodyCannotBe) {
  const BodyPlanner planner(*stair().snapshot, stair().octree);
  BodyState outside = stair().to;
  outside.x += 30;
  EXPECT_EQ(planner.plan(stair().from, outside).refusal, "the body cannot be at the goal");
  EXPECT_EQ(planner.plan(outside, stair().to).refusal, "the body cannot be at the start");
}

/// What the planner, and docs/howto/moveit.md, rely on: against every voxel by itself.
TEST(FclOctree, CollidesWithWhatIsOccupied) {
  const OccupancyView& view = stair().octree;
  const fcl::CollisionObjectd octree(
      std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(to_octree(view))));
  std::mt19937_64 random = test::rng();
  std::uniform_real_distribution<double> beside(-0.3, 0.3);
  const Eigen::Vector3d half(0.15, 0.12, 0.2), reach = half + Eigen::Vector3d::Constant(view.resolution());
  int hits = 0, misses = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d at = stair().points[random() % stair().points.size()] +
                               Eigen::Vector3d(beside(random), beside(random), beside(random));
    double overlap = -1;
    view.for_each_occupied({at - reach, at + reach}, [&](const OccupancyView::Voxel& voxel) {
      const Eigen::Array3d inside = half.array() + view.resolution() / 2 - (voxel.center - at).array().abs();
      overlap = std::max(overlap, inside.minCoeff());
      return true;
    });
    if (std::abs(overlap) < 1e-6) continue;  // they touch
    fcl::CollisionResultd result;
    const fcl::CollisionObjectd box(std::make_shared<fcl::Boxd>(0.3, 0.24, 0.4), Eigen::Matrix3d::Identity(),
                                    at);
    const bool hit = fcl::collide(&octree, &box, fcl::CollisionRequestd(), result) > 0;
    ASSERT_EQ(hit, overlap > 0);
    ++(hit ? hits : misses);
  }
  EXPECT_GT(hits, 20);
  EXPECT_GT(misses, 20);
}

}  // namespace
}  // namespace octosurf::examples
