// Single footholds: against regions, and against points sampled all over the contact.
#include "shapes.hpp"
#include "support/painted_octree.hpp"

#include <octosurf/contact.hpp>

namespace octosurf::planning {
namespace {

using namespace shapes;

bool in_any(const std::vector<Polygon>& polygons, const Eigen::Vector2d& p) {
  return std::any_of(polygons.begin(), polygons.end(),
                     [&p](const Polygon& polygon) { return inside(polygon, p); });
}

double distance_to_edges(const std::vector<Polygon>& polygons, const Eigen::Vector2d& p) {
  double best = HUGE_VAL;
  for (const Polygon& polygon : polygons) best = std::min(best, edge_distance(polygon, p));
  return best;
}

struct Asked {
  Surface on;
  ContactShape shape;
  double yaw = 0;
  ContactLimits limits{};
  const OccupancyView* octree = nullptr;

  Foothold at(const Eigen::Vector2d& uv, double height = 0) const {
    const Eigen::Vector3d point = on.to_map(uv) + height * on.plane.normal;
    return foothold(on, shape, point, yaw, limits, octree);
  }
  ContactRegion region() const { return contact_region(on, shape, yaw, limits, octree); }
};

// Accepted where the reference point lies in the region, and only there, but for the cells on its outline.
void expect_agree(const Asked& asked, std::mt19937_64& random, int points) {
  std::uniform_real_distribution<double> uniform(-2, 2);
  const ContactRegion region = asked.region();
  int accepted = 0;
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector2d uv(uniform(random), uniform(random));
    const Foothold foot = asked.at(uv, 0.3);
    const bool in = in_any(region.polygons, uv);
    constexpr double cells = 4 * 0.005;  // corners of the contact may be in one, and edges cut corners
    if (in || distance_to_edges(region.polygons, uv) > cells) {
      EXPECT_EQ(foot.accepted, in) << uv.transpose();
    }
    EXPECT_EQ(foot.accepted, !foot.refused);
    EXPECT_EQ(foot.surface, asked.on.id);
    EXPECT_LT((foot.T_map_contact.translation() - asked.on.to_map(uv)).norm(), 1e-9);
    EXPECT_LT((foot.T_map_contact.linear().col(2) - asked.on.plane.normal).norm(), 1e-12);
    accepted += foot.accepted;
  }
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, points);
}

TEST(Foothold, AgreesWithTheRegion) {
  std::mt19937_64 random(test::seed());
  for (int i = 0; i < 20 && !HasFailure(); ++i) {
    Asked asked{surface(5, {random_polygon(random)}, pose({1, -2, 0.5}, 0.4, {3, -5, 1.5})),
                ContactShape::rectangle(0.22, 0.11, 0.05), 0.7 * i};
    if (i % 3 == 1) asked.limits.edge_margin_m = 0.04;
    if (i % 3 == 2) asked.shape = ContactShape::disc(0.08);
    expect_agree(asked, random, 300);
  }
}

TEST(Foothold, AgreesWithTheRegionBesideObstacles) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-2, 2);
  test::PaintedOctree things(0.05);
  for (int i = 0; i < 40; ++i)
    things.occupy(static_cast<int>(20 * uniform(random)), static_cast<int>(20 * uniform(random)),
                  static_cast<int>(10 + 2 * uniform(random)), 1, 0);
  const OccupancyView octree = things.view();
  for (int i = 0; i < 10 && !HasFailure(); ++i) {
    Asked asked{surface(5, {random_polygon(random)}, pose({1, 0, 0}, 0.1, {0, 0, 0})),
                ContactShape::rectangle(0.2, 0.1),
                0.7 * i,
                {},
                &octree};
    asked.limits.clearance_m = 0.6;
    asked.limits.obstacle_margin_m = i % 2 == 0 ? 0 : 0.05;
    asked.limits.edge_margin_m = 0.01;
    expect_agree(asked, random, 300);
  }
}

TEST(Foothold, OfADiscDoesNotDependOnItsHeading) {
  // The polygon that stands for a disc reaches 0.5 % beyond it at its corners.
  const double radius = 0.03;
  Asked ask{surface(1, {{box(0, 0, 1, 1), {}}}), ContactShape::disc(radius), 0, {}};
  for (const double off : {1.001, 1.002, 1.003, 1.004}) {
    const bool accepted = ask.at({off * radius, 0.5}).accepted;
    for (ask.yaw = 0; ask.yaw < 2 * pi; ask.yaw += 0.01)
      ASSERT_EQ(ask.at({off * radius, 0.5}).accepted, accepted) << off << " at " << ask.yaw;
    ask.yaw = 0;
  }
}

TEST(Foothold, TellsTheShareOfSupport) {
  std::mt19937_64 random(test::seed());
  std::uniform_real_distribution<double> uniform(-2, 2);
  const Asked asked{surface(5, {random_polygon(random), {box(3, 0, 0.1, 0.1), {}}}),
                    ContactShape::rectangle(0.4, 0.3, 0.1), 0.6};
  int partly = 0;
  constexpr int steps = 60;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d uv(uniform(random), uniform(random));
    int on = 0;
    for (int x = 0; x < steps; ++x)
      for (int y = 0; y < steps; ++y) {
        const Eigen::Vector2d p(-0.1 + 0.4 * (x + 0.5) / steps, -0.15 + 0.3 * (y + 0.5) / steps);
        on += in_any(asked.on.polygons, uv + Eigen::Rotation2Dd(0.6) * p);
      }
    const double share = static_cast<double>(on) / (steps * steps);
    const Foothold foot = asked.at(uv);
    // Cells on an edge of length l are counted wrong over l d/8 on average; some 2 m of them are in the
    // contact.
    EXPECT_NEAR(foot.supported, share, 0.06);
    EXPECT_LE(foot.supported, share + 0.02);
    EXPECT_EQ(foot.supported == 1, foot.refused != ContactRefusal::support);
    partly += share > 0.02 && share < 0.98;
  }
  EXPECT_GT(partly, 0);
}

TEST(Foothold, TellsTheMarginToTheNearestEdge) {
  const Asked asked{surface(5, {{box(0, 0, 1, 1), {reversed(box(0.5, 0.5, 0.01, 0.01))}}}),
                    ContactShape::rectangle(0.2, 0.1), 0};
  constexpr double cell = 0.006, diagonal = 1.5 * cell;  // of 5 mm, found to a millimetre
  EXPECT_NEAR(asked.at({0.2, 0.3}).margin_m, 0.1, cell);
  EXPECT_NEAR(asked.at({0.3, 0.4}).margin_m, std::hypot(0.1, 0.05), diagonal);  // from corner to corner
  EXPECT_NEAR(asked.at({0.09, 0.3}).margin_m, -0.01, cell);                     // a centimetre over the edge
  EXPECT_NEAR(asked.at({0.09, 0.3}).supported, 0.95, cell / 0.1);
  EXPECT_NEAR(asked.at({0.505, 0.505}).margin_m, -0.05, cell);  // astride the hole
  EXPECT_NEAR(asked.at({0.42, 0.505}).margin_m, -0.02, cell);
  EXPECT_NEAR(asked.at({-3, 0.3}).margin_m, -0.05, cell);  // never more than half the contact's width
  EXPECT_EQ(asked.at({-3, 0.3}).supported, 0);
  EXPECT_NEAR(asked.at({0.9, 0.3}).margin_m, 0, cell);
  const Asked disc{asked.on, ContactShape::disc(0.1), 0};
  EXPECT_NEAR(disc.at({0.3, 0.4}).margin_m, std::hypot(0.2, 0.1) - 0.1, diagonal);
  EXPECT_NEAR(disc.at({0.08, 0.3}).margin_m, -0.02, cell + 0.005 * 0.1);
}

TEST(Foothold, NamesTheFirstLimitInOrder) {
  Asked asked{surface(5, {{box(0, 0, 1, 1), {}}}, pose({1, 0, 0}, 0.2, {0, 0, 0})),
              ContactShape::rectangle(0.2, 0.1), 0};
  EXPECT_FALSE(asked.at({0.5, 0.5}).refused);
  EXPECT_EQ(asked.at({0.05, 0.5}).refused, ContactRefusal::support);
  asked.limits.edge_margin_m = 0.1;
  EXPECT_EQ(asked.at({0.15, 0.5}).refused, ContactRefusal::margin);
  EXPECT_EQ(asked.at({0.05, 0.5}).refused, ContactRefusal::support);
  asked.limits.max_slope_rad = 0.1;
  EXPECT_EQ(asked.at({0.5, 0.5}).refused, ContactRefusal::slope);
  EXPECT_EQ(asked.at({0.5, 0.5}).supported, 1);  // what is known is told all the same
}

TEST(Foothold, RefusesWhatMakesNoSense) {
  const Surface on = surface(5, {{box(0, 0, 1, 1), {}}});
  EXPECT_THROW(foothold(on, ContactShape::disc(0.1), {std::nan(""), 0, 0}, 0), Error);
  EXPECT_THROW(foothold(on, ContactShape::disc(0.1), {0, 0, 0}, HUGE_VAL), Error);
  EXPECT_FALSE(foothold(Surface{}, ContactShape::disc(0.1), {0, 0, 0}, 0).accepted);  // without polygons
}

}  // namespace
}  // namespace octosurf::planning
