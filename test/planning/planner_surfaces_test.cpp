// What planners' formats are made of, against contact regions and pieces asked one by one.
#include "planning/shapes.hpp"
#include "support/polygons.hpp"

#include <octosurf/planner_formats.hpp>
#include <octosurf/up.hpp>

namespace octosurf::planning {
namespace {

using shapes::box;

constexpr double degree = std::numbers::pi / 180;

/// A square of `side`, tilted about the map's y axis.
SurfacePtr square(SurfaceId id, double side, double tilt_rad) {
  return std::make_shared<const Surface>(
      shapes::surface(id, {{box(0, 0, side, side), {}}},
                      shapes::pose({0, 1, 0}, tilt_rad, {static_cast<double>(id), -2, 0.3})));
}

/// A floor, a ledge too small to stand on, a slope and a wall that faces +x.
Snapshot four_squares() {
  Snapshot snapshot;
  snapshot.resolution = 0.02;
  snapshot.surfaces = {square(1, 1, 0), square(2, 0.1, 0), square(3, 1, 45 * degree),
                       square(4, 1, 90 * degree)};
  return snapshot;
}

/// m²: of regions of squares, to three cells of 5 mm.
constexpr double cells = 4 * 0.8 * 0.015;

TEST(PlannerSurfaces, AreThoseOfRegionsAndPiecesAskedOneByOne) {
  PlannerContact contact;
  contact.shape = ContactShape::rectangle(0.3, 0.1);
  contact.yaw_rad = 0.4;
  contact.limits.max_slope_rad = 50 * degree;
  contact.limits.edge_margin_m = 0.02;
  contact.pieces = 3;
  const Snapshot snapshot = four_squares();
  const std::vector<PlannerSurface> surfaces = planner_surfaces(snapshot, contact);
  for (std::size_t i = 0; i < snapshot.surfaces.size(); ++i) {
    const Surface& surface = *snapshot.surfaces[i];
    EXPECT_EQ(surfaces[i].id, surface.id);
    EXPECT_TRUE(surfaces[i].T_world_surface.isApprox(surface.T_map_surface));
    EXPECT_EQ(surfaces[i].polygons.at(0).outer, surface.polygons.at(0).outer);
    const ContactRegion region = contact_region(surface, contact.shape, contact.yaw_rad, contact.limits);
    ASSERT_EQ(surfaces[i].insets.size(), region.polygons.size());
    for (std::size_t k = 0; k < region.polygons.size(); ++k)
      EXPECT_EQ(surfaces[i].insets[k].outer, region.polygons[k].outer);
    const std::vector<ConvexPiece> pieces = convex_pieces(surface, region.polygons, 3);
    ASSERT_EQ(surfaces[i].pieces.size(), pieces.size());
    for (std::size_t k = 0; k < pieces.size(); ++k)
      EXPECT_EQ(surfaces[i].pieces[k].vertices, pieces[k].vertices);
  }
  EXPECT_FALSE(surfaces[0].pieces.empty());
  contact.pieces = 0;
  EXPECT_TRUE(planner_surfaces(snapshot, contact)[0].pieces.empty()) << "none were asked for";
}

TEST(PlannerSurfaces, AreTurnedWithTheirPieces) {
  PlannerContact contact;
  contact.shape = ContactShape::disc(0.1);
  contact.limits.up = Eigen::Vector3d::UnitX();  // so that the wall is the floor
  contact.turn = upright(contact.limits.up);
  contact.pieces = 2;
  const std::vector<PlannerSurface> surfaces = planner_surfaces(four_squares(), contact);
  EXPECT_TRUE(surfaces[0].insets.empty());
  const PlannerSurface& floor = surfaces[3];
  EXPECT_NEAR(test::area(floor.insets), 0.8 * 0.8, cells);
  EXPECT_NEAR(floor.T_world_surface(2, 2), 1, 1e-9);
  ASSERT_FALSE(floor.pieces.empty());
  for (const Eigen::Vector3d& vertex : floor.pieces[0].vertices) {
    const Eigen::Vector3d uvw = floor.T_world_surface.inverse() * vertex;
    EXPECT_NEAR(uvw.z(), 0, 1e-9);
    EXPECT_NEAR((uvw.head<2>() - Eigen::Vector2d(0.5, 0.5)).cwiseAbs().maxCoeff(), 0.4, 0.015);
  }
}

TEST(PlannerSurfaces, LimitsThatNeedTheOctreeAskForIt) {
  PlannerContact contact;
  contact.limits.clearance_m = 0.3;
  EXPECT_THROW(planner_surfaces(four_squares(), contact), Error);
}

}  // namespace
}  // namespace octosurf::planning
