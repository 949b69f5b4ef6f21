#include "alignment/near_surfaces.hpp"

#include "alignment/plane_raster.hpp"
#include "alignment/seen_patches.hpp"
#include "alignment/surfaces_by_hand.hpp"
#include "geometry/voxel_grid.hpp"
#include "planning/shapes.hpp"
#include "support/polygons.hpp"
#include "surfaces/map_state.hpp"
#include "surfaces/surface_model.hpp"

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

struct OffsetVariances {
  double published = 0, used = 0;
};

/// Of a long table, along which a robot looks once from where it says it is and once from poses that have
/// slid `slid_m` along the table's normal; the second time it sees a little more.
OffsetVariances after_slide(double slid_m) {
  auto rng = test::rng();
  Scene scene;
  scene.rectangle({0.03, 0.03, 0.03}, {3, 0, 0}, {0, 0.8, 0});
  Parameters parameters;
  parameters.align = false;
  Mapper mapper(parameters);
  for (const bool again : {false, true})
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d target(0.6 + 0.12 * i + (again ? 0.3 : 0), 0.43, 0.03);
      Scan scan = camera_scan(scene, look_at(target + Eigen::Vector3d(0, -0.6, 1), target), rng);
      if (again) scan.T_map_sensor.translation().z() += slid_m;
      mapper.insert(scan);
    }
  const surfaces::MapState& state = surfaces::state_of(mapper.map());
  const auto snapshot = mapper.snapshot();
  EXPECT_EQ(snapshot->surfaces.size(), 1U);
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  const alignment::AlignedSurface& table = *near.in(*snapshot, everywhere, &state).at(0);
  return {snapshot->surfaces.at(0)->covariance(2, 2), (table.covariance - table.by_boundary)(2, 2)};
}

TEST(NearSurfaces, PosesThatSlidDoNotMakeAPlaneUncertain) {
  const OffsetVariances slid = after_slide(0.004), exact = after_slide(0);
  // Weighed as it is published, the table would hardly hold a pose that slides off it …
  EXPECT_GT(slid.published, 100 * exact.published);
  EXPECT_GT(slid.published, 20 * slid.used);
  // … while its readings lie at two heights 4 mm apart, that is scatter by 2 mm, where voxels' means scatter
  // by half a millimetre or more otherwise: (2² + 0.5²) / 0.5² times the variance at most.
  EXPECT_LT(slid.used, 17 * exact.used);
  EXPECT_LE(exact.used, 1.0001 * exact.published);  // the boundary was taken off it again
}

TEST(NearSurfaces, AFinishedMapIsAsSureAsItSays) {
  Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto map = map_of_rectangles(scene, {0, 0, 1});
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  const alignment::AlignedSurface& floor = *near.in(*map, everywhere).at(0);
  EXPECT_EQ(floor.covariance, map->surfaces.at(0)->covariance + floor.by_boundary);
}

// Among scans that are mapped together, the first may take back a surface that the snapshot still has.
TEST(NearSurfaces, WhatIsGoneButPublishedStillIsNotNear) {
  Scene scene;
  scene.rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto published = map_of_rectangles(scene, {0, 0, 1});
  const Mapper mapper{Parameters{}};  // whose map has no surface
  const surfaces::MapState& state = surfaces::state_of(mapper.map());
  alignment::NearSurfaces near;
  const Eigen::AlignedBox3d everywhere(Eigen::Vector3d::Constant(-9), Eigen::Vector3d::Constant(9));
  EXPECT_EQ(near.in(*published, everywhere).size(), 1U);
  EXPECT_TRUE(near.in(*published, everywhere, &state).empty());
}

/// With deep bays.
Polygon star_with_hole(std::mt19937_64& rng, const Eigen::Vector2d& centre) {
  return {shapes::star(rng, centre, 1.2, 3.1, 23),
          {shapes::reversed(shapes::star(rng, centre, 0.2, 0.9, 11))}};
}

constexpr double infinity = std::numeric_limits<double>::infinity();
const Eigen::AlignedBox2d everywhere(Eigen::Vector2d::Constant(-infinity),
                                     Eigen::Vector2d::Constant(infinity));

TEST(PlaneRaster, CoversCellsWhoseNeighboursAreInside) {
  auto rng = test::rng();
  constexpr double edge = 0.04;
  std::uniform_real_distribution<double> shift(-3, 3);
  for (int world = 0; world < 20; ++world) {
    const Eigen::Vector2d centre(shift(rng), shift(rng));
    const std::vector<Polygon> polygons{star_with_hole(rng, centre),
                                        {shapes::star(rng, centre + Eigen::Vector2d(5, 5), 0.1, 1, 7), {}}};
    const alignment::PlaneRaster raster(polygons, edge, everywhere);
    const Region inside(polygons);
    Eigen::Vector2d low = centre.array() + 1e9, high = centre.array() - 1e9;
    for (const Polygon& polygon : polygons)
      for (const Eigen::Vector2d& vertex : polygon.outer)
        low = low.cwiseMin(vertex), high = high.cwiseMax(vertex);
    std::size_t covered = 0;
    for (double x = low.x() - 2.5 * edge; x < high.x() + 3 * edge; x += edge)
      for (double y = low.y() - 2.5 * edge; y < high.y() + 3 * edge; y += edge) {
        bool all = true;  // (x, y) is a cell's centre
        for (const double dx : {-edge, 0.0, edge})
          for (const double dy : {-edge, 0.0, edge}) all = all && inside.covers({x + dx, y + dy});
        ASSERT_EQ(raster.covers(x, y), all) << "world " << world << " at " << x << ", " << y;
        covered += all;
      }
    EXPECT_GT(covered, 1000U);
  }
}

TEST(PlaneRaster, OfAWindowCoversTheSameThere) {
  auto rng = test::rng();
  constexpr double edge = 0.04;
  std::uniform_real_distribution<double> place(-4, 4), size(0.1, 3), within(0, 1);
  std::size_t covered = 0;
  for (int world = 0; world < 50; ++world) {
    const std::vector<Polygon> polygons{star_with_hole(rng, {0.3, 0.2})};
    const Eigen::Vector2d low(place(rng), place(rng));
    const Eigen::AlignedBox2d window(low, low + Eigen::Vector2d(size(rng), size(rng)));
    const alignment::PlaneRaster whole(polygons, edge, everywhere), part(polygons, edge, window);
    EXPECT_TRUE(part.holds(window));
    EXPECT_TRUE(whole.holds(everywhere));
    for (int i = 0; i < 1000; ++i) {
      const Eigen::Vector2d p =
          window.min() + window.sizes().cwiseProduct(Eigen::Vector2d(within(rng), within(rng)));
      ASSERT_EQ(part.covers(p.x(), p.y()), whole.covers(p.x(), p.y())) << "world " << world << " at " << p;
      covered += whole.covers(p.x(), p.y());
      const Eigen::Vector2d anywhere(place(rng), place(rng));
      if (part.covers(anywhere.x(), anywhere.y())) {
        ASSERT_TRUE(whole.covers(anywhere.x(), anywhere.y()));
      }
      ASSERT_EQ(part.near(anywhere, 0.1), whole.near(anywhere, 0.1));
    }
  }
  const alignment::PlaneRaster part({{{{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {}}}, edge,
                                    {Eigen::Vector2d(2, 2), Eigen::Vector2d(4, 4)});
  EXPECT_TRUE(part.holds({Eigen::Vector2d(3, 3), Eigen::Vector2d(4, 4)}));
  EXPECT_FALSE(part.holds({Eigen::Vector2d(3, 3), Eigen::Vector2d(4, 5)}));
  EXPECT_FALSE(part.holds(everywhere));
  EXPECT_GT(covered, 1000U);
}

/// The map under construction has no polygons at hand. Both rasters close gaps up to h: by triangles the one,
/// by squares the other; so beyond h / 2 of the boundary and the two cells that are taken off it they agree.
TEST(PlaneRaster, OfCellsIsThatOfThePolygonsButAtTheBoundary) {
  auto rng = test::rng();
  constexpr double d = 0.02, h = 0.08, edge = 2 * d;
  std::uniform_real_distribution<double> turn(-3, 3), within(-3.2, 3.2), missing(0, 1);
  std::size_t covered = 0, differ = 0, looked_at = 0;
  for (int world = 0; world < 10; ++world) {
    const Region region({star_with_hole(rng, {0, 0})});
    surfaces::SurfaceModel model(1, {}, Eigen::Vector3d::Zero(), d);
    const geometry::VoxelGrid grid(d);
    for (double x = -3.2 + d / 2; x < 3.2; x += d)
      for (double y = -3.2 + d / 2; y < 3.2; y += d) {
        const Eigen::Vector3f at(static_cast<float>(x), static_cast<float>(y), 0);
        geometry::VoxelKey key;
        if (region.covers({x, y}) && missing(rng) < 0.7 && grid.key_of(at, key)) model.add({key, 0, at});
      }
    model.derive(h);
    const Eigen::Isometry3d T_frame_surface(Eigen::AngleAxisd(turn(rng), Eigen::Vector3d::UnitZ()));
    std::vector<Polygon> polygons = model.polygons();
    const auto turned = [&](Ring2& ring) {
      for (Eigen::Vector2d& p : ring) p = T_frame_surface.linear().topLeftCorner<2, 2>() * p;
    };
    for (Polygon& polygon : polygons) {
      turned(polygon.outer);
      std::for_each(polygon.holes.begin(), polygon.holes.end(), turned);
    }
    const Eigen::AlignedBox2d window(Eigen::Vector2d(-3, -2), Eigen::Vector2d(3, 2));
    const alignment::PlaneRaster slow(polygons, edge, everywhere),
        part(model, T_frame_surface * model.pose().inverse(), h, edge, window);
    EXPECT_TRUE(part.holds(window));
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector2d p(within(rng), within(rng));
      if (!window.contains(p)) continue;
      ++looked_at;
      covered += part.covers(p.x(), p.y());
      if (part.covers(p.x(), p.y()) == slow.covers(p.x(), p.y())) continue;
      ++differ;
      ASSERT_LT(distance_to_rings(p, polygons), h / 2 + 2 * std::sqrt(2) * edge)
          << "world " << world << " at " << p;
    }
  }
  EXPECT_GT(covered, looked_at / 4);
  EXPECT_LT(differ, looked_at / 20);
}

TEST(PlaneRaster, OfNothingCoversNothing) {
  const alignment::PlaneRaster raster({}, 0.04, everywhere);
  EXPECT_FALSE(raster.covers(0, 0));
  const alignment::PlaneRaster sliver({{{{0, 0}, {1, 0}, {1, 0.01}}, {}}}, 0.04, everywhere);
  EXPECT_FALSE(sliver.covers(0.9, 0.005));
}

TEST(PlaneRaster, HugePlanesGetCoarserCells) {
  const double side = 3e4;
  const alignment::PlaneRaster raster({{{{0, 0}, {side, 0}, {side, side}, {0, side}}, {}}}, 0.02, everywhere);
  EXPECT_TRUE(raster.covers(side / 2, side / 2));
  EXPECT_FALSE(raster.covers(-1, side / 2));
}

// What is remembered of a surface's patches, and how long ago that was.

using alignment::Observation;
using alignment::SeenPatch;
using alignment::SeenPatches;

constexpr double span = 1;

Observation look_at_distance(double distance) {
  Observation observation;
  observation.weight = 1;
  observation.distance = static_cast<float>(distance);
  return observation;
}

TEST(SeenPatches, OldLooksAreAtLeastASpanOldAndNoneOfThreeSpansIsMissing) {
  auto rng = test::rng();
  std::uniform_real_distribution<double> step(0, 0.6);
  SeenPatch patch;
  std::vector<double> ways;
  for (double way = 0; way < 30; way += step(rng)) {
    const Observation before = patch.before(way, span);
    // Weights are 1 each and the distances are the ways: the oldest `n` observations have this mean.
    const auto n = static_cast<std::size_t>(before.weight + 0.5F);
    ASSERT_LE(n, ways.size());
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) sum += ways[i] / static_cast<double>(n);
    if (n > 0) {
      EXPECT_NEAR(before.distance, sum, 1e-3);
      EXPECT_LE(ways[n - 1], way - span + 1e-9);
    }
    for (std::size_t i = n; i < ways.size(); ++i) EXPECT_GT(ways[i], way - 3 * span);
    if (ways.empty()) patch.since = way;
    patch.add(look_at_distance(way), way, span);
    ways.push_back(way);
  }
}

TEST(SeenPatches, LooksCountByTheirWeight) {
  Observation observation = look_at_distance(1), other = look_at_distance(4);
  other.weight = 2;
  other.by_error[3] = 3;
  observation.add(other);
  observation.add(Observation{});
  EXPECT_FLOAT_EQ(observation.weight, 3);
  EXPECT_FLOAT_EQ(observation.distance, 3);
  EXPECT_FLOAT_EQ(observation.by_error[3], 2);
}

}  // namespace
}  // namespace octosurf::test
