// Voids told from places that nobody saw, on octrees painted by hand.
#include "geometry/ring_check.hpp"
#include "geometry/rings.hpp"
#include "planning/cell_raster.hpp"
#include "planning/cell_runs.hpp"
#include "planning/ground_tiles.hpp"
#include "planning/rings.hpp"
#include "planning/shapes.hpp"
#include "support/painted_octree.hpp"

#include <octosurf/footsteps.hpp>
#include <octosurf/ground.hpp>

namespace octosurf::planning {
namespace {

constexpr double edge = 0.02;  // m, of a voxel

/// A level floor at z = 0, seen from above, of whole cells of `edge`.
struct Floor {
  test::PaintedOctree octree{edge};
  Surface surface;

  Floor() {
    surface.id = 1;
    surface.resolution = edge;
    surface.T_map_surface.translation().z() = edge / 2;
    surface.plane.offset = edge / 2;
    surface.rms_m = 0.002;
  }
  void outline(double low_u, double low_v, double high_u, double high_v) {
    surface.polygons.push_back({{{low_u, low_v}, {high_u, low_v}, {high_u, high_v}, {low_u, high_v}}, {}});
    surface.area_m2 = geometry::area_of(surface.polygons.back());
  }
  /// Columns u, v in [from, to) of cells.
  template <class Paint>
  static void for_each(int from_u, int from_v, int to_u, int to_v, const Paint& paint) {
    for (int v = from_v; v < to_v; ++v)
      for (int u = from_u; u < to_u; ++u) paint(u, v);
  }
  void read(int from_u, int from_v, int to_u, int to_v) {
    for_each(from_u, from_v, to_u, to_v, [&](int u, int v) { octree.occupy(u, v, 0, 2, 1); });
  }
  void open(int from_u, int from_v, int to_u, int to_v) {
    for_each(from_u, from_v, to_u, to_v, [&](int u, int v) {
      for (int z = 0; z >= -3; --z) octree.free(u, v, z);
    });
  }
};

/// The floor as the ground for a foot.
GroundView view_of(const Surface& floor, const OccupancyView& octree, const ContactShape& foot,
                   std::optional<double> widest_unseen_m = {}) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->resolution = edge;
  snapshot->surfaces = {std::make_shared<const Surface>(floor)};
  GroundRules rules;
  rules.foot = foot;
  rules.widest_unseen_m = widest_unseen_m;
  return {snapshot, octree, rules};
}

struct Found {
  SurfacePtr surface;
  std::vector<Gap> gaps;
};

Found find_gaps(const Surface& floor, const OccupancyView& octree, double widest_unseen_m = widest_gap_m) {
  const GroundView view = view_of(floor, octree, Biped{}.foot, widest_unseen_m);
  return {view.solid(1), view.gaps(1)};
}

bool stands(const Surface& surface, double u, double v) {
  return std::any_of(surface.polygons.begin(), surface.polygons.end(), [&](const Polygon& polygon) {
    return contains(polygon, {u, v});
  });
}

// 1 m² of floor closed by its outline over a slot of `cells` voxels that rays went through. Readings lie in
// the middles of voxels, and the outline's edge anywhere between the last and the slot.
TEST(Gaps, ASlotIsAHoleHoweverNarrow) {
  for (const int cells : {1, 2, 3, 5}) {
    Floor floor;
    floor.outline(0, 0, 1, 1);
    floor.read(0, 0, 20, 50);
    floor.read(20 + cells, 0, 50, 50);
    floor.open(20, 0, 20 + cells, 50);
    const Found found = find_gaps(floor.surface, floor.octree.view());
    EXPECT_FALSE(geometry::fault_of(found.surface->polygons));
    EXPECT_LE(found.surface->area_m2, 1 - cells * edge + 1e-9) << cells;
    EXPECT_GE(found.surface->area_m2, 1 - (cells + 2) * edge) << cells;
    for (double u = 20.1; u < 20 + cells; u += 0.2)
      for (double v = 0.5; v < 50; ++v)
        EXPECT_FALSE(stands(*found.surface, u * edge, v * edge)) << cells << ' ' << u;
    ASSERT_EQ(found.gaps.size(), 1U);
    EXPECT_EQ(found.gaps[0].kind, Ground::open);
  }
}

// Free space over a plane, as rays along it leave it, says nothing of what lies under it: a place without
// readings on a floor that was seen without a gap.
TEST(Gaps, FreeSpaceBeforeThePlaneIsNoVoid) {
  Floor floor;
  floor.outline(0, 0, 1, 1);
  floor.read(0, 0, 20, 50);
  floor.read(25, 0, 50, 50);
  Floor::for_each(20, 0, 25, 50, [&](int u, int v) { floor.octree.free(u, v, 0); });
  const Found found = find_gaps(floor.surface, floor.octree.view());
  ASSERT_EQ(found.gaps.size(), 1U);
  EXPECT_EQ(found.gaps[0].kind, Ground::unseen);
  EXPECT_NEAR(found.surface->area_m2, 1 - 5 * edge, edge);
}

// Two holes of 0.3 m in a floor of 2 × 1 m that is seen without a gap: a void and a shadow. Neither is
// bridged.
TEST(Gaps, AVoidAndAShadowAreToldApart) {
  Floor floor;
  floor.outline(0, 0, 2, 1);
  const auto hole = [&](double u) {
    floor.surface.polygons[0].holes.push_back({{u, 0.3}, {u, 0.6}, {u + 0.3, 0.6}, {u + 0.3, 0.3}});
  };
  hole(0.4);
  hole(1.2);
  Floor::for_each(0, 0, 100, 50, [&](int u, int v) {
    const bool in_hole = v >= 15 && v < 30 && ((u >= 20 && u < 35) || (u >= 60 && u < 75));
    if (!in_hole) floor.octree.occupy(u, v, 0, 2, 1);
  });
  floor.open(20, 15, 35, 30);
  const OccupancyView octree = floor.octree.view();
  const Found found = find_gaps(floor.surface, octree);
  ASSERT_EQ(found.gaps.size(), 2U);
  EXPECT_EQ(found.gaps[0].kind, Ground::open);
  EXPECT_EQ(found.gaps[1].kind, Ground::unseen);
  for (const Gap& gap : found.gaps) {
    EXPECT_FALSE(gap.bridged);
    EXPECT_NEAR(gap.width_m, 0.3, 0.3 * 0.25 + edge);
    EXPECT_NEAR(geometry::area_of(gap.outline), 0.09, 1e-9);
  }
  EXPECT_NEAR(found.surface->area_m2, 2 - 2 * 0.09, 1e-9);
  const GroundView view = view_of(floor.surface, octree, Biped{}.foot);
  EXPECT_EQ(view.ground_at(1, {0.2, 0.5, edge / 2}), Ground::supported);
  EXPECT_EQ(view.ground_at(1, {0.55, 0.45, edge / 2}), Ground::open);
  EXPECT_EQ(view.ground_at(1, {1.35, 0.45, edge / 2}), Ground::unseen);
}

/// Lines of readings two cells wide across 3 m, farther apart from line to line, as a lidar's rings.
double add_rings(Floor& floor) {
  int u = 0, gap = 4;
  while (u + 2 + gap <= 150) {
    floor.read(u, 0, u + 2, 100);
    floor.outline(u * edge, 0, (u + 2) * edge, 2);
    u += 2 + gap;
    gap += 1;
  }
  floor.read(u, 0, u + 2, 100);
  floor.outline(u * edge, 0, (u + 2) * edge, 2);
  return (u + 2) * edge * 2;
}

TEST(Gaps, TheFloorBetweenRingsIsWhole) {
  Floor floor;
  const double area = add_rings(floor);
  const Found found = find_gaps(floor.surface, floor.octree.view());
  EXPECT_EQ(found.surface->polygons.size(), 1U);
  // The ends of the last gaps are round, as a disc of half a metre closes them.
  EXPECT_GT(found.surface->area_m2, 0.97 * area);
  EXPECT_LE(found.surface->area_m2, 1.02 * area);
  for (const Gap& gap : found.gaps) EXPECT_TRUE(gap.bridged);
  // A planner whose foot spans 10 cm leaves wider gaps open.
  const Found narrow = find_gaps(floor.surface, floor.octree.view(), 0.1);
  EXPECT_GT(narrow.surface->polygons.size(), 3U);
  EXPECT_LT(narrow.surface->area_m2, 0.7 * area);
}

// Readings in 17 cells of 20. Of places of 2 × 2 cells one in 2000 has none by chance alone, so a floor has
// some; of 3 × 3 none. What rays passed just before was not hidden.
TEST(Gaps, WhatReadingsMissByChanceIsWhole) {
  for (const int cells : {2, 3})
    for (const bool passed : {true, false}) {
      Floor floor;
      floor.outline(0, 0, 1, 1);
      const double low = 20 * edge, high = (20 + cells) * edge;
      floor.surface.polygons[0].holes.push_back({{low, low}, {low, high}, {high, high}, {high, low}});
      std::mt19937_64 rng(test::seed());
      Floor::for_each(0, 0, 50, 50, [&](int u, int v) {
        const bool in_hole = std::min(u, v) >= 20 && std::max(u, v) < 20 + cells;
        if (in_hole && passed) floor.octree.free(u, v, 1);
        if (!in_hole && rng() % 20 < 17) floor.octree.occupy(u, v, 0, 2, 1);
      });
      const Found found = find_gaps(floor.surface, floor.octree.view());
      const double middle = (low + high) / 2;
      EXPECT_EQ(stands(*found.surface, middle, middle), passed && cells == 2) << cells << ' ' << passed;
    }
}

// Rings over a trench that ends two voxels deep on another surface, over one that nobody saw the end of, and
// rings over a board as low.
TEST(Gaps, NothingIsBridgedOverAVoidHoweverShallowOrALowBoard) {
  for (const int height : {-2, -4, 2}) {
    Floor floor;
    add_rings(floor);
    const auto unread = [&](int u, int v) {
      return floor.octree.view().at({(u + 0.5) * edge, (v + 0.5) * edge, edge / 2}).state ==
             OccupancyView::State::unknown;
    };
    std::vector<std::pair<int, int>> there;
    Floor::for_each(60, 30, 150, 50, [&](int u, int v) {
      if (unread(u, v)) there.emplace_back(u, v);
    });
    for (const auto& [u, v] : there) {
      if (height != -4) floor.octree.occupy(u, v, height, 2, 2);
      for (int z = height + 1; z <= 0; ++z) floor.octree.free(u, v, z);
    }
    const OccupancyView octree = floor.octree.view();
    const Found found = find_gaps(floor.surface, octree);
    const GroundView view = view_of(floor.surface, octree, Biped{}.foot);
    for (const auto& [u, v] : there) {
      const Eigen::Vector2d at((u + 0.5) * edge, (v + 0.5) * edge);
      EXPECT_FALSE(stands(*found.surface, at.x(), at.y())) << height << ": " << u << ' ' << v;
      EXPECT_EQ(view.ground_at(1, {at.x(), at.y(), edge / 2}), height < 0 ? Ground::open : Ground::blocked);
    }
  }
}

// A sole half over a void; and one of a kilometre, which takes no longer.
TEST(Gaps, AFootIsToldWhatItWouldStandOn) {
  Floor floor;
  floor.outline(0, 0, 1, 1);
  floor.read(0, 0, 50, 50);
  floor.open(50, 0, 60, 50);
  const OccupancyView octree = floor.octree.view();
  const auto under = [&](const ContactShape& shape) {
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.translation() = Eigen::Vector3d(1, 0.5, edge / 2);
    return view_of(floor.surface, octree, shape).ground_under(1, at);
  };
  const auto share = [](const auto& shares, Ground ground) {
    return shares[static_cast<std::size_t>(ground)];
  };
  const auto sole = under(ContactShape::rectangle(0.2, 0.1));
  EXPECT_NEAR(share(sole, Ground::supported), 0.5, 1e-9);
  EXPECT_NEAR(share(sole, Ground::open), 0.5, 1e-9);
  EXPECT_GT(share(under(ContactShape::rectangle(1000, 1000)), Ground::unseen), 0.99);
}

// Polygons with holes, islands in them and touching parts, and how two versions differ.
TEST(Gaps, RunsAreTheCellsInsideOfPolygons) {
  std::mt19937_64 rng(test::seed());
  const auto ring = [&rng](const Eigen::Vector2d& middle, double radius, bool clockwise) {
    const Ring2 star = shapes::star(rng, middle, 0.7 * radius, radius, 9);
    return clockwise ? shapes::reversed(star) : star;
  };
  const CellRaster raster({-30, -30}, {80, 30}, 0.05);
  std::vector<std::pair<std::vector<Polygon>, Mask>> all;
  for (int round = 0; round < 4; ++round) {
    const std::vector<Polygon> polygons{{ring({0, 0}, 1, false), {ring({0.1, 0}, 0.5, true)}},
                                        {ring({0.1, 0}, 0.3, false), {}},
                                        {ring({2, 0.2}, 0.6, false), {}}};
    Mask with_holes(raster.cells(), 0), filled = with_holes;
    CellRuns(polygons, 0.05).mark(raster, false, with_holes);
    CellRuns(polygons, 0.05).mark(raster, true, filled);
    for (std::size_t i = 0; i < raster.cells(); ++i) {
      const auto in = [&](const Polygon& polygon) { return contains(polygon, raster.middle(i)); };
      const auto in_outer = [&](const Polygon& polygon) { return in({polygon.outer, {}}); };
      EXPECT_EQ(with_holes[i] != 0, std::any_of(polygons.begin(), polygons.end(), in)) << i;
      EXPECT_EQ(filled[i] != 0, std::any_of(polygons.begin(), polygons.end(), in_outer)) << i;
    }
    for (std::size_t i = 0; i < filled.size(); ++i)
      with_holes[i] = static_cast<std::uint8_t>(with_holes[i] | 2 * filled[i]);
    all.emplace_back(polygons, with_holes);
  }
  all.emplace_back(std::vector<Polygon>{}, Mask(raster.cells(), 0));
  for (const auto& [before, mask_before] : all)
    for (const auto& [now, mask] : all) {
      Mask differs(raster.cells(), 0), expected = differs;
      for (std::size_t i = 0; i < mask.size(); ++i) expected[i] = mask[i] != mask_before[i];
      CellRuns(now, 0.05).for_each_difference(
          CellRuns(before, 0.05), [&](std::int64_t row, std::int64_t from, std::int64_t to) {
            for (std::int64_t x = from; x < to; ++x)
              differs[static_cast<std::size_t>((row + 30) * raster.width() + x + 30)] = 1;
          });
      EXPECT_EQ(differs, expected);
    }
}

// The morphology against its definitions, cell by cell.
TEST(Gaps, RasterOperationsAreWhatTheyAreDefinedAs) {
  std::mt19937_64 rng(test::seed());
  const CellRaster raster({-2, -2}, {22, 16}, 0.05);
  Mask mask(raster.cells());
  for (std::uint8_t& cell : mask) cell = rng() % 8 == 0;
  const std::vector<float> distance = raster.distance_to(mask);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    double nearest = 1e9;
    for (std::size_t k = 0; k < mask.size(); ++k)
      if (mask[k] != 0) nearest = std::min(nearest, (raster.middle(k) - raster.middle(i)).norm() / 0.05);
    EXPECT_NEAR(distance[i], nearest, 1e-3);
  }
  const Mask closed = raster.closed(mask, 2), opened = raster.opened(closed, 1.5);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    EXPECT_GE(closed[i], mask[i]);
    EXPECT_LE(opened[i], closed[i]);
  }
}

}  // namespace
}  // namespace octosurf::planning
