#include "shapes.hpp"
#include "support/seed.hpp"

#include <gmock/gmock.h>
#include <limits>
#include <random>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>

namespace octosurf {
namespace {

using namespace shapes;

Snapshot snapshot_of(std::vector<Surface> surfaces) {
  Snapshot snapshot;
  for (Surface& one : surfaces) snapshot.surfaces.push_back(std::make_shared<const Surface>(std::move(one)));
  return snapshot;
}

// All surfaces, all edges.
double slow_distance(const Snapshot& snapshot, const Eigen::Vector3d& point) {
  double best = HUGE_VAL;
  for (const SurfacePtr& on : snapshot.surfaces) {
    const Eigen::Vector3d local = on->T_map_surface.inverse() * point;
    for (const Polygon& polygon : on->polygons) {
      const bool above = inside(polygon, local.head<2>());
      best = std::min(best, std::hypot(local.z(), above ? 0.0 : edge_distance(polygon, local.head<2>())));
    }
  }
  return best;
}

TEST(Nearest, AboveBesideAndOverAHole) {
  const Snapshot snapshot = snapshot_of({surface(3, {{box(0, 0, 3, 3), {reversed(box(1, 1, 1, 1))}}})});
  auto found = nearest(snapshot, {0.5, 0.5, 2});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->id, 3u);
  EXPECT_NEAR((found->point - Eigen::Vector3d(0.5, 0.5, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(found->distance, 2, 1e-12);
  found = nearest(snapshot, {6, 7, 0});
  ASSERT_TRUE(found);
  EXPECT_NEAR((found->point - Eigen::Vector3d(3, 3, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(found->distance, 5, 1e-12);
  found = nearest(snapshot, {1.25, 1.5, 0});
  ASSERT_TRUE(found);
  EXPECT_NEAR((found->point - Eigen::Vector3d(1, 1.5, 0)).norm(), 0, 1e-12);
}

TEST(Nearest, PlaneThatIsNearerButWhosePolygonIsNot) {
  const Snapshot snapshot =
      snapshot_of({surface(1, {{box(10, 10, 1, 1), {}}}),
                   surface(2, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0, {0, 0, -2}))});
  const auto found = nearest(snapshot, {0.5, 0.5, 0.1});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->id, 2u);
  EXPECT_NEAR(found->distance, 2.1, 1e-12);
}

TEST(Nearest, LowerIdWinsATie) {
  const Snapshot snapshot =
      snapshot_of({surface(1, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0, {0, 0, 1})),
                   surface(2, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0, {0, 0, -1}))});
  EXPECT_EQ(nearest(snapshot, {0.5, 0.5, 0})->id, 1u);
}

TEST(Nearest, NothingFromNothing) {
  EXPECT_FALSE(nearest(Snapshot{}, {0, 0, 0}));
  EXPECT_FALSE(nearest(snapshot_of({surface(1, {})}), {0, 0, 0}));
}

TEST(Nearest, RefusesNotFinite) {
  EXPECT_THROW(nearest(Snapshot{}, {0, 0, std::numeric_limits<double>::quiet_NaN()}), Error);
}

TEST(Nearest, AgreesWithLookingAtEverything) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> at(-4, 4);
  const auto point = [&] { return Eigen::Vector3d(at(random), at(random), at(random)); };
  std::vector<Surface> surfaces;
  for (SurfaceId id = 1; id <= 12; ++id) {
    surfaces.push_back(surface(id, {random_polygon(random)}, pose(point(), at(random), point())));
  }
  const Snapshot snapshot = snapshot_of(std::move(surfaces));
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p = point();
    const auto found = nearest(snapshot, p);
    ASSERT_TRUE(found);
    ASSERT_NEAR(found->distance, slow_distance(snapshot, p), 1e-9);
    ASSERT_NEAR((found->point - p).norm(), found->distance, 1e-12);
    const Surface& on = *snapshot.surfaces[found->id - 1];
    const Eigen::Vector2d uv = to_uv(on, found->point);
    ASSERT_TRUE(inside(on.polygons[0], uv) || edge_distance(on.polygons[0], uv) < 1e-9);
  }
}

}  // namespace
}  // namespace octosurf
