// The index against looking at every surface and every edge.
#include "planning/questions.hpp"
#include "shapes.hpp"
#include "support/painted_octree.hpp"
#include "support/polygons.hpp"

#include <octosurf/queries.hpp>
#include <octosurf/up.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;
using testing::ElementsAre;
using testing::IsEmpty;

/// Stars with holes, and some level squares, whose planes are those of a house.
std::shared_ptr<Snapshot> random_map(std::mt19937_64& random, int count) {
  std::vector<Surface> surfaces;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d at = random_vector(random, 8);
    const auto id = static_cast<SurfaceId>(2 * i + 1);
    if (i % 3 == 0)
      surfaces.push_back(surface(id, {{box(0, 0, 2, 1), {}}, {box(3, 0, 1, 1), {}}},
                                 pose({1, 0, 0}, i % 2 == 0 ? 0 : pi, at)));
    else
      surfaces.push_back(surface(
          id, {random_polygon(random)},
          pose(random_vector(random, 1) + Eigen::Vector3d(0, 0, 1.1), random_vector(random, pi).x(), at)));
  }
  return snapshot_of(std::move(surfaces));
}

bool on(const Surface& s, const Eigen::Vector2d& uv) {
  return std::ranges::any_of(s.polygons, [&](const Polygon& polygon) { return inside(polygon, uv); });
}

bool within(const Surface& s, const SlopeLimit& limit) {
  return slope_rad(s, limit.up) <= limit.max_slope_rad;
}

/// Its distance and id; infinite, if there is none.
std::pair<double, SurfaceId> slow_nearest(const Snapshot& snapshot, const Eigen::Vector3d& point,
                                          const SlopeLimit& limit = {}) {
  std::pair<double, SurfaceId> best(HUGE_VAL, 0);
  for (const SurfacePtr& s : snapshot.surfaces) {
    if (!within(*s, limit)) continue;
    const Eigen::Vector3d local = s->T_map_surface.inverse() * point;
    for (const Polygon& polygon : s->polygons) {
      const bool above = inside(polygon, local.head<2>());
      const double aside = above ? 0.0 : edge_distance(polygon, local.head<2>());
      best = std::min(best, std::pair(std::hypot(local.z(), aside), s->id));
    }
  }
  return best;
}

std::optional<RayHit> slow_ray(const Snapshot& snapshot, const Eigen::Vector3d& from,
                               const Eigen::Vector3d& direction, const SlopeLimit& limit = {}) {
  std::optional<RayHit> first;
  for (const SurfacePtr& s : snapshot.surfaces) {
    const double speed = s->plane.normal.dot(direction.normalized());
    const double distance = -s->plane.signed_distance(from) / speed;
    const Eigen::Vector3d point = from + distance * direction.normalized();
    if (distance < 0 || (first && distance >= first->distance)) continue;
    if (within(*s, limit) && on(*s, to_uv(*s, point))) first = RayHit{s->id, point, distance, speed < 0};
  }
  return first;
}

TEST(SurfaceIndex, NearestAndBelowAreWhatLookingAtEverySurfaceGives) {
  std::mt19937_64 random(test::seed());
  int met = 0;
  for (int map = 0; map < 5; ++map) {
    const auto snapshot = random_map(random, map == 0 ? 1 : 60);
    const SurfaceIndex index(snapshot);
    for (int round = 0; round < 200; ++round) {
      const Eigen::Vector3d point = random_vector(random, 10);
      SlopeLimit limit;
      if (round % 2 == 1) limit = {random_vector(random, 1), random_vector(random, 1).cwiseAbs().x()};
      const auto [distance, id] = slow_nearest(*snapshot, point, limit);
      const auto found = index.nearest(point, limit);
      ASSERT_EQ(found.has_value(), id != 0);
      if (found) {
        EXPECT_EQ(found->id, id);
        EXPECT_NEAR(found->distance, distance, 1e-12);
        EXPECT_NEAR((found->point - point).norm(), found->distance, 1e-12);
        EXPECT_NEAR(slow_nearest(*snapshot, found->point).first, 0, 1e-9);
        EXPECT_TRUE(index.nearest(point, limit, 1.0001 * found->distance));
        EXPECT_FALSE(index.nearest(point, limit, 0.9999 * found->distance));
      }
      const auto under = slow_ray(*snapshot, point, -limit.up, limit);
      const auto found_below = index.below(point, limit);
      ASSERT_EQ(found_below.has_value(), under.has_value());
      if (!found_below) continue;
      ++met;
      EXPECT_EQ(found_below->id, under->id);
      EXPECT_NEAR(found_below->distance, under->distance, 1e-9);
      EXPECT_NEAR((found_below->point - under->point).norm(), 0, 1e-9);
    }
  }
  EXPECT_GT(met, 50);
}

TEST(SurfaceIndex, TheLowerIdWinsATieAndOneStandsOnWhatIsAtTheFoot) {
  const SurfaceIndex index(
      snapshot_of({surface(1, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0, {0, 0, 1})),
                   surface(2, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0, {0, 0, -1})), surface(3, {})}));
  EXPECT_EQ(index.nearest({0.5, 0.5, 0})->id, 1u);
  EXPECT_EQ(index.below({0.5, 0.5, -1})->id, 2u);
  EXPECT_FALSE(index.below({0.5, 0.5, -1.01}));
}

TEST(SurfaceIndex, ARayMeetsTheFirstSurfaceFromEitherSide) {
  std::mt19937_64 random(test::seed());
  const auto snapshot = random_map(random, 60);
  const SurfaceIndex index(snapshot);
  int hits = 0, backs = 0;
  for (int round = 0; round < 2000; ++round) {
    const Eigen::Vector3d from = random_vector(random, 10), direction = random_vector(random, 3);
    const auto expected = slow_ray(*snapshot, from, direction), found = index.first_on_ray(from, direction);
    ASSERT_EQ(found.has_value(), expected.has_value());
    if (!found) continue;
    EXPECT_EQ(found->id, expected->id);
    EXPECT_EQ(found->front, expected->front);
    EXPECT_NEAR(found->distance, expected->distance, 1e-9);
    EXPECT_NEAR((found->point - expected->point).norm(), 0, 1e-9);
    EXPECT_FALSE(index.first_on_ray(from, direction, 0.999 * expected->distance));
    ++hits;
    backs += !found->front;
  }
  EXPECT_GT(hits, 200);
  EXPECT_GT(backs, 50);
}

/// By cutting a large square in the surface's plane, and Boost's polygons: another way than the index goes.
bool slow_meets(const Surface& s, const ConvexSpace& space) {
  Ring2 part = box(-40, -40, 80, 80);
  for (const Plane& plane : space.planes) {
    const Eigen::Vector2d normal = (s.T_map_surface.linear().transpose() * plane.normal).head<2>();
    const double offset = plane.offset - plane.normal.dot(s.T_map_surface.translation());
    Ring2 kept;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Eigen::Vector2d &a = part[i], &b = part[(i + 1) % part.size()];
      const double at_a = normal.dot(a) - offset, at_b = normal.dot(b) - offset;
      if (at_a <= 0) kept.push_back(a);
      if ((at_a <= 0) != (at_b <= 0)) kept.push_back(a + at_a / (at_a - at_b) * (b - a));
    }
    part = kept;
  }
  return part.size() >= 3 && test::intersection({{part, {}}}, s.polygons).area > 0;
}

TEST(SurfaceIndex, ListsWhatMeetsABoxAConvexSpaceASphere) {
  std::mt19937_64 random(test::seed());
  const auto snapshot = random_map(random, 60);
  const SurfaceIndex index(snapshot);
  std::size_t listed = 0, left_out = 0;
  for (int round = 0; round < 200; ++round) {
    Eigen::AlignedBox3d box(random_vector(random, 9));
    box.extend(box.min() + random_vector(random, 2).cwiseAbs());
    const Eigen::Isometry3d turn =
        pose(random_vector(random, 1), random_vector(random, 3).x(), random_vector(random, 6));
    const Eigen::Vector3d eye = random_vector(random, 9);
    const double radius = random_vector(random, 2).cwiseAbs().x();
    ConvexSpace wedge = ConvexSpace::box({Eigen::Vector3d(-1, -2, 0), Eigen::Vector3d(2, 1, 4)});
    wedge.planes.push_back({Eigen::Vector3d(0.6, 0, 0.8), 2});
    for (Plane& plane : wedge.planes) {
      plane.normal = turn.linear() * plane.normal;
      plane.offset += plane.normal.dot(turn.translation());
    }
    for (const ConvexSpace& space : {ConvexSpace::box(box), wedge}) {
      std::vector<SurfaceId> expected;
      for (const SurfacePtr& s : snapshot->surfaces)
        if (slow_meets(*s, space)) expected.push_back(s->id);
      EXPECT_EQ(index.in(space), expected);
      listed += expected.size();
      left_out += snapshot->surfaces.size() - expected.size();
    }
    std::vector<SurfaceId> expected;
    for (const SurfacePtr& s : snapshot->surfaces) {
      if (slow_nearest(*snapshot_of({*s}), eye).first <= radius) expected.push_back(s->id);
    }
    EXPECT_EQ(index.in_sphere(eye, radius), expected);
  }
  EXPECT_GT(listed, 100U) << "enough to compare: 332 in the mean of 400 worlds, deviation 34";
  EXPECT_GT(left_out, 300U);
}

TEST(SurfaceIndex, ASpaceInsideASurfaceOrAHole) {
  const auto snapshot =
      snapshot_of({surface(1, {{box(0, 0, 4, 4), {reversed(box(1, 1, 2, 2))}}, {box(1.5, 1.5, 1, 1), {}}})});
  const SurfaceIndex index(snapshot);
  const auto around = [&](double x, double y) {
    const Eigen::Vector3d middle(x, y, 0), half(0.1, 0.1, 0.1);
    return index.in(ConvexSpace::box({middle - half, middle + half}));
  };
  EXPECT_THAT(around(0.5, 0.5), ElementsAre(1));
  EXPECT_THAT(around(1.25, 1.25), IsEmpty()) << "in the hole";
  EXPECT_THAT(around(2, 2), ElementsAre(1)) << "on the island in it";
  EXPECT_THAT(index.in(ConvexSpace::box({Eigen::Vector3d(4, 4, 0), Eigen::Vector3d(5, 5, 1)})),
              ElementsAre(1))
      << "a corner that touches";
  EXPECT_THAT(index.in(ConvexSpace{}), ElementsAre(1)) << "no limits";
}

TEST(SurfaceIndex, TakesOverWhatHasNotChanged) {
  std::mt19937_64 random(test::seed());
  const auto first = random_map(random, 40);
  const SurfaceIndex old(first);
  auto second = std::make_shared<Snapshot>(*first);
  second->surfaces.erase(second->surfaces.begin() + 5);
  for (std::size_t i = 0; i < second->surfaces.size(); i += 7) {
    Surface moved = *second->surfaces[i];
    moved.T_map_surface.pretranslate(random_vector(random, 3));
    moved.plane.offset = moved.plane.normal.dot(moved.T_map_surface.translation());
    second->surfaces[i] = std::make_shared<const Surface>(std::move(moved));
  }
  second->surfaces.push_back(std::make_shared<const Surface>(surface(200, {{box(0, 0, 1, 1), {}}})));
  const SurfaceIndex fresh(second), followed(second, &old);
  for (int round = 0; round < 200; ++round) {
    const Eigen::Vector3d point = random_vector(random, 10);
    const auto a = fresh.nearest(point), b = followed.nearest(point);
    ASSERT_EQ(a->id, b->id);
    ASSERT_EQ(a->point, b->point);
    ASSERT_EQ(old.nearest(point)->point, SurfaceIndex(first).nearest(point)->point) << "the old one stays";
  }
}

TEST(SurfaceIndex, NothingFromNothingAndNonsenseIsRefused) {
  const SurfaceIndex index(std::make_shared<Snapshot>());
  EXPECT_FALSE(index.nearest({0, 0, 0}));
  EXPECT_FALSE(index.below({0, 0, 0}));
  EXPECT_FALSE(index.first_on_ray({0, 0, 0}, {0, 0, 1}));
  EXPECT_THAT(index.in_sphere({0, 0, 0}, 1), IsEmpty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(index.nearest({nan, 0, 0}), Error);
  EXPECT_THROW(index.nearest({0, 0, 0}, {}, nan), Error);
  EXPECT_THROW(index.nearest({0, 0, 0}, {Eigen::Vector3d::Zero(), 1}), Error);
  EXPECT_THROW(index.nearest({0, 0, 0}, {Eigen::Vector3d::UnitZ(), nan}), Error);
  EXPECT_THROW(index.below({nan, 0, 0}), Error);
  EXPECT_THROW(index.first_on_ray({0, 0, 0}, {0, 0, 0}), Error);
  EXPECT_THROW(index.first_on_ray({0, 0, 0}, {0, 0, 1}, -1), Error);
  EXPECT_THROW(index.in_sphere({0, 0, 0}, -1), Error);
  EXPECT_THROW(index.in({{Plane{{nan, 0, 0}, 0}}}), Error);
  EXPECT_THROW(SurfaceIndex(nullptr), Error);
}

/// Before a stair's riser, which is nearer to the foot than the floor is.
TEST(FootholdQuestion, IsOfWhatALoweredFootMeets) {
  const double up = -pi / 2, ramp = pi / 4;
  const auto stair = snapshot_of({surface(1, {{box(-1, -1, 1.5, 2), {}}}),
                                  surface(2, {{box(0, -1, 0.2, 2), {}}}, pose({0, 1, 0}, up, {0.5, 0, 0})),
                                  surface(3, {{box(0.5, -1, 1, 2), {}}}, pose({0, 0, 1}, 0, {0, 0, 0.2})),
                                  surface(4, {{box(0, 0, 2, 2), {}}}, pose({0, 1, 0}, ramp, {5, 0, 0}))});
  const AskedMap map("stair", stair, test::PaintedOctree(0.02).view(), Eigen::Vector3d::UnitZ());
  const auto found = [&](const Eigen::Vector3d& at) {
    ContactQuestion question;
    question.at = at;
    question.foot = ContactShape::disc(0.02);
    return find_foothold(map, question).foothold;
  };
  EXPECT_EQ(map.index.nearest({0.49, 0, 0.05})->id, 2u);
  EXPECT_EQ(found({0.49, 0, 0.05}).surface, 1u);
  EXPECT_EQ(found({0.51, 0, 0.15}).surface, 3u);
  EXPECT_EQ(found({-1.02, 0, 0.01}).surface, 1u) << "beside its outline";
  EXPECT_EQ(found({6, 1, -1}).surface, 4u);
  EXPECT_EQ(found({6, 1, -1}).refused, ContactRefusal::slope) << "nothing else is there";
  using testing::HasSubstr, testing::ThrowsMessage;
  EXPECT_THAT([&] { found({0, 0, 0.9}); }, ThrowsMessage<Error>(HasSubstr("surface 1 is 0.90 m below it")));
  EXPECT_THAT(
      [&] {
        found({0, 4, 0});
      },
      ThrowsMessage<Error>(HasSubstr("1 is 3.00 m off, and nothing below it")));
}

}  // namespace
}  // namespace octosurf::planning
