// Contact regions against what exact arithmetic, and the eye, says of small surfaces.
#include "geometry/ring_check.hpp"
#include "planning/contact_shape.hpp"
#include "planning/exact_region.hpp"
#include "planning/rings.hpp"
#include "shapes.hpp"
#include "support/painted_octree.hpp"
#include "support/polygons.hpp"

#include <octosurf/contact.hpp>
#include <octosurf/up.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;
using testing::ElementsAre;
using testing::IsEmpty;

// m: cells, and the area along a metre of outline that they may cost: one where the edge is, one where the
// contact's middle is, and less than one where rings are simplified.
constexpr double cell = 0.02 / 4, grid_loss = 3 * cell;

/// The contact's outline about its reference point as it stands on a level surface whose frame is the map's.
Ring2 turned(const Ring2& outline, double yaw) {
  Ring2 result;
  for (const Eigen::Vector2d& p : outline) result.push_back(Eigen::Rotation2Dd(yaw) * p);
  return result;
}

// Guarantees 1 and 2 of the header: not a point too many, and none too few but for the cells.
void expect_exact(const Surface& on, const ContactShape& shape, double yaw) {
  const ContactRegion region = contact_region(on, shape, yaw);
  const test::ExactRegion exact(on.polygons, turned(shape.outline, yaw));
  EXPECT_EQ(region.surface, on.id);
  EXPECT_TRUE(exact.covers(region.polygons));
  EXPECT_LE(region.area_m2, exact.area());
  EXPECT_GT(region.area_m2, exact.area() - grid_loss * (test::perimeter(region.polygons) + 0.5));
  EXPECT_NEAR(region.area_m2, test::area(region.polygons), 1e-12);
  EXPECT_FALSE(geometry::fault_of(region.polygons));
  EXPECT_EQ(region.polygons.empty(), !region.refused.empty());
}

TEST(ContactRegion, OfAllHeadingsIsThatOfTheDiscAround) {
  const Surface on = surface(1, {{box(0, 0, 1, 1), {}}});
  const ContactShape sole = ContactShape::rectangle(0.16, 0.12);  // reaches 0.1 m
  const ContactRegion any = contact_region(on, sole, {});
  EXPECT_FALSE(any.yaw_rad);
  EXPECT_LT(any.area_m2, 0.8 * 0.8);
  EXPECT_GT(any.area_m2, 0.8 * 0.8 - 4 * 0.8 * (0.005 * 0.1 + grid_loss));  // and the 0.5 % of contact.hpp
  const ContactRegion disc = contact_region(on, ContactShape::disc(0.1), 0.3);
  EXPECT_NEAR(disc.area_m2, any.area_m2, 4 * 0.8 * 0.005 * 0.1);  // turned, and so is the polygon around it
}

// Also of a contact whose reference point lies off it, and of one that is no rectangle.
TEST(ContactRegion, OfRandomPolygonsIsExact) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(0, 1);
  ContactShape other;
  other.outline = {{-0.1, -0.04}, {0.02, -0.06}, {0.12, 0.0}, {0.05, 0.07}, {-0.08, 0.03}};
  for (int i = 0; i < 15 && !HasFailure(); ++i) {
    const Surface on = surface(7, {random_polygon(random)});
    const double length = 0.05 + 0.4 * uniform(random), before = length * (3 * uniform(random) - 1);
    expect_exact(on, i % 3 == 0 ? other : ContactShape::rectangle(length, 0.5 * length, before),
                 2 * pi * uniform(random));
  }
}

// Edges in line with the contact's, vertices on one line, rings that share vertices, holes that fit exactly:
// what exact arithmetic is for.
TEST(ContactRegion, WhereEverythingCoincides) {
  std::mt19937_64 random(test::seed());
  const ContactShape sole = ContactShape::rectangle(0.2, 0.1);
  const Ring2 comb{{0, 0},     {2, 0},   {2, 1}, {1.8, 1}, {1.8, 0.5}, {1.5, 0.5}, {1.5, 1}, {1.3, 1},
                   {1.3, 0.5}, {1, 0.5}, {1, 1}, {0.8, 1}, {0.8, 0.5}, {0.5, 0.5}, {0.5, 1}, {0, 1}};
  for (const double yaw : {0.0, pi / 2, pi, pi / 4}) {
    expect_exact(surface(1, {{comb, {}}}), sole, yaw);
    const Polygon pinched{box(0, 0, 4, 4),
                          {reversed({{0, 0}, {2, 1}, {2, 2}, {1, 2}}), reversed({{2, 2}, {3, 2}, {3, 3}})}};
    expect_exact(surface(1, {pinched, {{{4, 4}, {5, 4}, {5, 5}}, {}}}), sole, yaw);
    Polygon grid{box(0, 0, 2, 2), {}};
    for (int x = 0; x < 5; ++x)
      for (int y = 0; y < 5; ++y)
        if (random() % 2 == 0) grid.holes.push_back(reversed(box(0.2 + 0.3 * x, 0.2 + 0.3 * y, 0.1, 0.1)));
    expect_exact(surface(1, {grid}), sole, yaw);
    // Nothing fits on an island smaller than the contact, nor beside a hole inside it.
    expect_exact(surface(1, {{box(0, 0, 0.1, 0.1), {reversed(box(0.04, 0.04, 0.02, 0.02))}},
                             {box(0.15, 0, 0.1, 0.1), {}},
                             {box(0.3, 0, 0.05, 0.3), {}}}),
                 ContactShape::rectangle(0.22, 0.11), yaw + 0.4);
  }
}

// A gap that the contact fits exactly has no inside; one that is some cells wider has.
TEST(ContactRegion, WhereTheContactJustFits) {
  const ContactShape sole = ContactShape::rectangle(0.2, 0.1);
  const ContactRegion none = contact_region(surface(1, {{box(0, 0, 1, 0.1), {}}}), sole, 0.0);
  EXPECT_THAT(none.polygons, IsEmpty());
  EXPECT_THAT(none.refused, ElementsAre(ContactRefusal::support));
  EXPECT_FALSE(contact_region(surface(1, {{box(0, 0, 1, 0.1 + 4 * cell), {}}}), sole, 0.0).polygons.empty());
}

TEST(ContactRegion, TurnsWithTheMap) {
  std::mt19937_64 random(test::seed());
  const std::vector<Polygon> polygons{random_polygon(random)};
  const Surface flat = surface(1, polygons);
  const ContactShape sole = ContactShape::rectangle(0.3, 0.1, 0.1);
  const Eigen::Isometry3d T = pose({1, 2, 3}, 1.1, {4, -2, 1});
  const Surface moved = surface(1, polygons, T);
  const ContactRegion here = contact_region(flat, sole, 0.0);
  // Headings are told about `up`, whose zero turns otherwise than the map: sought on the surface.
  ContactLimits limits;
  limits.up = T.linear() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d zero = heading_on(moved, 0, limits.up);
  const ContactRegion there = contact_region(moved, sole, -std::atan2(zero.y(), zero.x()), limits);
  EXPECT_LT(test::exact_difference(here.polygons, there.polygons),
            grid_loss * test::perimeter(here.polygons));
}

TEST(ContactHeading, IsTheMapsProjectedOntoThePlane) {
  const Surface floor = surface(1, {{box(0, 0, 1, 1), {}}}, pose({0, 0, 1}, pi / 2, {0, 0, 0}));
  EXPECT_LT((heading_on(floor, 0, {0, 0, 2}) - Eigen::Vector2d(0, -1)).norm(), 1e-12);
  EXPECT_LT((heading_on(floor, pi / 2, {0, 0, 2}) - Eigen::Vector2d(1, 0)).norm(), 1e-12);
  const Surface ramp = surface(1, {{box(0, 0, 1, 1), {}}}, pose({0, 1, 0}, -0.4, {0, 0, 0}));
  EXPECT_LT((heading_on(ramp, 0, {0, 0, 1}) - Eigen::Vector2d(1, 0)).norm(), 1e-12);
  // A wall that faces +x: its heading, straight into it, is up.
  const Surface wall = surface(1, {{box(0, 0, 1, 1), {}}}, pose({0, 1, 0}, pi / 2, {0, 0, 0}));
  const Eigen::Vector2d up = heading_on(wall, 0, {0, 0, 1});
  EXPECT_LT(
      (wall.T_map_surface.linear() * Eigen::Vector3d(up.x(), up.y(), 0) - Eigen::Vector3d(0, 0, 1)).norm(),
      1e-12);
}

TEST(ContactLimits, OfTheSurfaceRefuseItWhole) {
  Surface on = surface(1, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0.2, {0, 0, 0}));
  on.rms_m = 0.004;
  on.covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-6).asDiagonal();
  const ContactShape sole = ContactShape::disc(0.05);
  const auto refused = [&](const ContactLimits& limits) {
    return contact_region(on, sole, {}, limits).refused;
  };
  ContactLimits limits;
  EXPECT_THAT(refused(limits), IsEmpty());
  limits.max_slope_rad = 0.19;
  EXPECT_THAT(refused(limits), ElementsAre(ContactRefusal::slope));
  limits.up = -limits.up;
  limits.max_slope_rad = pi;
  EXPECT_THAT(refused(limits), IsEmpty());
  limits.min_area_m2 = 1.01;
  limits.max_rms_m = 0.003;
  limits.max_normal_std_rad = 0.009;
  EXPECT_THAT(refused(limits),
              ElementsAre(ContactRefusal::size, ContactRefusal::roughness, ContactRefusal::uncertainty));
  limits = {};
  limits.max_rms_m = 0.005;
  limits.max_normal_std_rad = 0.011;
  limits.max_offset_std_m = 0.0009;
  EXPECT_THAT(refused(limits), ElementsAre(ContactRefusal::uncertainty));
  limits.max_offset_std_m = 0.0011;
  EXPECT_THAT(refused(limits), IsEmpty());
}

TEST(ContactLimits, MarginsAreKeptAllRound) {
  const Surface on = surface(1, {{box(0, 0, 1, 1), {}}});
  ContactLimits limits;
  limits.edge_margin_m = 0.05;
  const ContactRegion region = contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.0, limits);
  EXPECT_NEAR(region.area_m2, 0.7 * 0.8, 3 * grid_loss);
  EXPECT_LT(region.area_m2, 0.7 * 0.8);
  limits.edge_margin_m = 0.46;
  EXPECT_THAT(contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.0, limits).refused,
              ElementsAre(ContactRefusal::margin));
}

/// Occupied in these voxels of 2 cm.
OccupancyView octree_of(const std::vector<Eigen::Array3i>& voxels) {
  test::PaintedOctree octree(0.02);
  for (const Eigen::Array3i& at : voxels) octree.occupy(at.x(), at.y(), at.z(), 1, 0);
  return octree.view();
}

TEST(ContactLimits, ObstaclesAndWhatHangsOverAreKeptClearOf) {
  const Surface on = surface(3, {{box(0, 0, 1, 1), {}}});
  const OccupancyView octree = octree_of({{25, 25, 15}, {5, 5, 0}, {45, 45, 25}});
  const ContactShape sole = ContactShape::rectangle(0.2, 0.1);
  ContactLimits limits;
  limits.clearance_m =
      0.4;  // the one at 0.31 m only: the lowest lies on the surface, the highest over all this
  const ContactRegion clear = contact_region(on, sole, 0.0, limits, &octree);
  EXPECT_NEAR(clear.area_m2, 0.8 * 0.9 - 0.22 * 0.12, 4 * grid_loss);
  limits.obstacle_margin_m = 0.1;
  const ContactRegion apart = contact_region(on, sole, 0.0, limits, &octree);
  EXPECT_NEAR(apart.area_m2, 0.8 * 0.9 - (0.22 * 0.12 + 2 * 0.1 * (0.22 + 0.12) + pi * 0.01), 5 * grid_loss);
  EXPECT_LT(apart.area_m2, 0.8 * 0.9 - (0.22 * 0.12 + 2 * 0.1 * (0.22 + 0.12) + pi * 0.01));
  limits.obstacle_margin_m = 0;
  limits.obstacle_from_m = 0.33;
  EXPECT_NEAR(contact_region(on, sole, 0.0, limits, &octree).area_m2, 0.8 * 0.9, 4 * grid_loss);
  EXPECT_THROW(contact_region(on, sole, 0.0, limits), Error);
}

TEST(ContactLimits, ObstaclesBesideTheSurfaceKeepItsContactsOff) {
  const Surface on = surface(3, {{box(0, 0, 1, 1), {}}});
  const OccupancyView octree = octree_of({{52, 25, 15}});
  ContactLimits limits;
  limits.clearance_m = 0.4;
  limits.obstacle_margin_m = 0.1;
  const ContactRegion apart = contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.0, limits, &octree);
  limits.obstacle_margin_m = 0;
  const ContactRegion without = contact_region(on, ContactShape::rectangle(0.2, 0.1), 0.0, limits, &octree);
  EXPECT_LT(apart.area_m2, without.area_m2 - 0.05 * 0.2);
}

TEST(ContactLimits, WhatLeavesNothingIsNamed) {
  const Surface on = surface(3, {{box(0, 0, 0.4, 0.4), {}}});
  const OccupancyView octree = octree_of({{10, 10, 15}});
  ContactLimits limits;
  limits.clearance_m = 0.4;
  const ContactShape sole = ContactShape::rectangle(0.3, 0.3);
  EXPECT_THAT(contact_region(on, sole, 0.0, limits, &octree).refused, ElementsAre(ContactRefusal::clearance));
  const ContactShape small = ContactShape::rectangle(0.1, 0.1);
  EXPECT_THAT(contact_region(on, small, 0.0, limits, &octree).refused, IsEmpty());
  limits.obstacle_margin_m = 0.3;
  EXPECT_THAT(contact_region(on, small, 0.0, limits, &octree).refused, ElementsAre(ContactRefusal::obstacle));
  limits.obstacle_margin_m = 0.05;
  limits.edge_margin_m = 0.1;  // each leaves something, together nothing
  EXPECT_THAT(contact_region(on, ContactShape::rectangle(0.12, 0.12), 0.0, limits, &octree).refused,
              ElementsAre(ContactRefusal::margin, ContactRefusal::obstacle, ContactRefusal::clearance));
}

// fixed: holes that touch at a corner were one ring that came there twice, which readers of outlines refuse.
TEST(Reshaped, WhatTouchesAtACornerIsRingsOfItsOwn) {
  const Ring2 a = box(1, 1, 1, 1), b = box(2, 2, 1, 1), c = box(3, 1, 1, 1), at_rim = box(0, 2, 1, 2),
              beyond = box(4, 4, 1, 1);
  const Polygon square{box(0, 0, 4, 4), {}};
  const std::vector<Ring2> added{beyond}, removed{a, b, c, at_rim};
  const std::vector<Polygon> found = reshaped({&square, 1}, added, removed);
  EXPECT_FALSE(geometry::fault_of(found));
  double sum = 0;
  for (const Polygon& polygon : found) sum += area(polygon);
  EXPECT_NEAR(sum, 16 + 1 - 5, 1e-9);
}

TEST(ContactRegion, RefusesWhatMakesNoSense) {
  const Surface on = surface(1, {{box(0, 0, 1, 1), {}}});
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  EXPECT_THROW(ContactShape::rectangle(0, 0.1), Error);
  EXPECT_THROW(ContactShape::rectangle(0.1, nan), Error);
  EXPECT_THROW(ContactShape::disc(-1), Error);
  for (const Ring2& outline : {Ring2{{0, 0}, {1, 0}}, Ring2{{0, 0}, {0, 1}, {1, 0}},   // clockwise
                               Ring2{{0, 0}, {1, 0}, {0.1, 0.1}, {0, 1}},              // not convex
                               Ring2{{0, 0}, {1, 0}, {0, 1}, {0, 0}, {1, 0}, {0, 1}},  // twice round
                               Ring2{{0, 0}, {infinity, 0}, {0, 1}}}) {
    ContactShape shape;
    shape.outline = outline;
    EXPECT_THROW(contact_region(on, shape, 0.0), Error);
  }
  EXPECT_THROW(contact_region(on, ContactShape::disc(0.1), nan), Error);
  for (double ContactLimits::*field :
       {&ContactLimits::edge_margin_m, &ContactLimits::obstacle_margin_m, &ContactLimits::obstacle_from_m,
        &ContactLimits::clearance_m, &ContactLimits::min_area_m2}) {
    ContactLimits limits;
    limits.*field = -0.1;
    EXPECT_THROW(contact_region(on, ContactShape::disc(0.1), {}, limits), Error);
  }
  ContactLimits limits;
  limits.up = Eigen::Vector3d::Zero();
  EXPECT_THROW(contact_region(on, ContactShape::disc(0.1), {}, limits), Error);
  limits = {};
  limits.obstacle_margin_m = 0.1;
  const OccupancyView nothing;
  EXPECT_THROW(contact_region(on, ContactShape::disc(0.1), {}, limits, &nothing), Error);
  Surface far = surface(1, {{box(1e9, 0, 1, 1), {}}});
  EXPECT_THROW(contact_region(far, ContactShape::disc(0.1), {}), Error);
  far.polygons[0].outer[0].x() = nan;
  EXPECT_THROW(contact_region(far, ContactShape::disc(0.1), {}), Error);
}

}  // namespace
}  // namespace octosurf::planning
