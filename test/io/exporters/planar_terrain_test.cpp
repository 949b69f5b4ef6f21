// PlanarTerrain messages, decoded from their definitions and asked what ocs2 and legged_perceptive ask.
#include "io/exporters/planner_fixture.hpp"
#include "io/exporters/planner_messages.hpp"
#include "io/ros_messages.hpp"
#include "support/polygons.hpp"

#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

using ros::Json;

HeightGrid small_grid() {
  HeightGrid grid;
  grid.cell = 0.05;
  grid.center = {4, -1};
  grid.elevation = Eigen::MatrixXf::Constant(40, 44, 0.75F);
  grid.elevation(3, 5) = std::nanf("");
  grid.elevation(20, 20) = 0.25F;
  grid.elevation(20, 21) = std::nanf("");
  grid.surface = grid.elevation;
  grid.normal.fill(grid.elevation);
  return grid;
}

std::vector<octosurf::Polygon> polygon_of(const Json& from) {
  const auto ring = [](const Json& of) {
    Ring2 vertices;
    for (const Json& point : of.at("points"))
      vertices.emplace_back(point.at("x").get<float>(), point.at("y").get<float>());
    return vertices;
  };
  Polygon polygon{ring(from.at("outer_boundary")), {}};
  for (const Json& hole : from.at("holes")) polygon.holes.push_back(ring(hole));
  return {polygon};
}

Json written(const std::vector<PlannerSurface>& surfaces) {
  return ros::decode(planar_terrain_message(surfaces, small_grid(), "odom"), "PlanarTerrain");
}

TEST(PlanarTerrainMessage, RegionsHavePoseBoxBoundaryAndInsetsInside) {
  const PlannerSurface table = table_with_hole(5);
  const Json regions = written({table}).at("planarRegions");
  ASSERT_EQ(regions.size(), 1u) << "not the island";
  const Json &region = regions[0], &insets = region.at("insets");
  EXPECT_EQ(region.at("plane_parameters"), Json::parse(R"({"position": {"x": 3, "y": -2, "z": 0.75},
                            "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}})"));
  EXPECT_EQ(region.at("bbox2d"), Json::parse(R"({"min_x": 0, "min_y": 0, "max_x": 2, "max_y": 2})"));
  EXPECT_EQ(region.at("boundary").at("holes").size(), 1u);
  ASSERT_EQ(insets.size(), 1u);
  EXPECT_EQ(insets[0].at("holes").size(), 1u);
  const auto boundary = polygon_of(region.at("boundary")), inset = polygon_of(insets[0]);
  EXPECT_EQ(invalid(boundary), "");
  EXPECT_NEAR(area(boundary), 4 - 0.16, 1e-6);
  EXPECT_NEAR(area(inset), 1.8 * 1.8 - 0.36, 1e-6);
  EXPECT_NEAR(intersection(boundary, inset).area, area(inset), 1e-6);
}

TEST(PlanarTerrainMessage, PosesTurnThePlaneIntoTheWorld) {
  std::mt19937_64 random = rng();
  std::vector<PlannerSurface> surfaces;
  for (int i = 0; i < 50; ++i) {
    PlannerSurface surface = random_surface(random, 1 + i, i * 79.0 / 49 * std::numbers::pi / 180);
    surface.polygons = surface.insets = {shapes::random_polygon(random)};
    surfaces.push_back(surface);
  }
  const Json regions = written(surfaces).at("planarRegions");
  ASSERT_EQ(regions.size(), surfaces.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Json &pose = regions[i].at("plane_parameters"), &p = pose.at("position"),
               &o = pose.at("orientation");
    const Eigen::Quaterniond q(o.at("w"), o.at("x"), o.at("y"), o.at("z"));
    const Eigen::Vector2d corner = polygon_of(regions[i].at("boundary"))[0].outer[0];
    const Eigen::Vector3d world =
        q * Eigen::Vector3d(corner.x(), corner.y(), 0) + Eigen::Vector3d(p.at("x"), p.at("y"), p.at("z"));
    const Eigen::Vector2d uv = surfaces[i].polygons[0].outer[0];
    EXPECT_LT((world - surfaces[i].T_world_surface * Eigen::Vector3d(uv.x(), uv.y(), 0)).norm(), 1e-6);
    // "Along gravity": they divide by the normal's z.
    EXPECT_GT((q * Eigen::Vector3d::UnitZ()).z(), 0.17);
  }
}

TEST(PlanarTerrainMessage, SteepAndCrampedRegionsAreLeftOut) {
  std::mt19937_64 random = rng();
  PlannerSurface wall = random_surface(random, 8, 81 * std::numbers::pi / 180);
  PlannerSurface ceiling = random_surface(random, 9, std::numbers::pi);
  wall.polygons = wall.insets = ceiling.polygons = ceiling.insets = {{shapes::box(0, 0, 1, 1), {}}};
  PlannerSurface cramped = table_with_hole(6);
  cramped.insets.clear();
  const Json regions = written({wall, ceiling, cramped, table_with_hole(7)}).at("planarRegions");
  EXPECT_EQ(regions.size(), 1u);
  for (const Json& region : regions) EXPECT_FALSE(region.at("insets").empty());
  EXPECT_THROW(planar_terrain_message({wall}, small_grid(), "map"), Error);
  EXPECT_THROW(planar_terrain_message({table_with_hole(5)}, {}, "map"), Error);
}

TEST(PlanarTerrainMessage, WithoutARegionItIsATerrainWithoutFootholds) {
  PlannerSurface cramped = table_with_hole(6);
  cramped.insets.clear();
  const std::vector<PlannerSurface> surfaces{cramped};
  const std::vector<io::TerrainRegion> none = io::terrain_regions(surfaces);
  EXPECT_TRUE(none.empty());
  const Json terrain = ros::decode(
      io::cdr_of([&](io::MessageWriter& out) { io::write_planar_terrain(out, none, small_grid(), "odom"); }),
      "PlanarTerrain");
  EXPECT_TRUE(terrain.at("planarRegions").empty());
  EXPECT_EQ(terrain.at("gridmap"), written({table_with_hole(5)}).at("gridmap"));
}

TEST(PlanarTerrainMessage, EveryInsetGoesToThePolygonItLiesIn) {
  PlannerSurface surface;
  surface.id = 1;
  surface.polygons = {{shapes::box(0, 0, 1, 1), {}}, {shapes::box(2, 0, 1, 1), {}}};
  surface.insets = {{shapes::box(2.1, 0.1, 0.3, 0.8), {}},
                    {shapes::box(0, 0, 1, 1), {}},
                    {shapes::box(2.6, 0.1, 0.3, 0.8), {}}};
  const Json regions = written({surface}).at("planarRegions");
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].at("insets").size(), 1u);
  EXPECT_EQ(regions[1].at("insets").size(), 2u);
}

TEST(PlanarTerrainMessage, TheGridHasTheLayersThatReadersDereferenceWithoutGaps) {
  const Json map = written({table_with_hole(5)}).at("gridmap");
  EXPECT_EQ(map.at("info").at("header").at("frame_id"), "odom");
  for (const Json& layer : map.at("data"))
    for (const Json& height : layer.at("data"))
      EXPECT_TRUE(height.is_number() && std::isfinite(height.get<double>()));
  const HeightGrid grid = small_grid();
  const auto at = [&](Eigen::Index row, Eigen::Index column, const char* layer) {
    const Eigen::Vector2d center = grid.center_of(row, column);
    return ros::at_position(map, layer, center.x(), center.y());
  };
  EXPECT_EQ(at(20, 20, "elevation"), 0.25F);
  EXPECT_EQ(at(20, 21, "elevation"), 0.25F);  // the lowest on its rim
  EXPECT_EQ(at(3, 5, "elevation"), 0.75F);
  EXPECT_EQ(at(30, 30, "smooth_planar"), 0.75F);
  EXPECT_NEAR(at(20, 20, "smooth_planar"), (23 * 0.75 + 2 * 0.25) / 25, 1e-6);
}

/// Each gap by itself, over and over until nothing changes: slow and obvious.
Eigen::MatrixXf without_gaps_by_sweeps(const Eigen::MatrixXf& given) {
  constexpr float none = std::numeric_limits<float>::infinity();
  Eigen::MatrixXf lowest = given.unaryExpr([](float h) { return std::isnan(h) ? none : h; });
  const auto lower = [&](Eigen::Index r, Eigen::Index c, Eigen::Index r2, Eigen::Index c2) {
    if (r2 < 0 || c2 < 0 || r2 >= given.rows() || c2 >= given.cols()) return false;
    if (lowest(r2, c2) >= lowest(r, c)) return false;
    lowest(r, c) = lowest(r2, c2);
    return true;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index r = 0; r < given.rows(); ++r)
      for (Eigen::Index c = 0; c < given.cols(); ++c)
        if (std::isnan(given(r, c)))
          for (const auto& [dr, dc] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
            changed = lower(r, c, r + dr, c + dc) || changed;
  }
  return lowest;
}

TEST(TerrainLayers, GapsAreFilledAsBySweeps) {
  std::mt19937_64 random = rng();
  for (int round = 0; round < 50; ++round) {
    Eigen::MatrixXf heights(1 + random() % 12, 1 + random() % 12);
    for (float& height : heights.reshaped())
      height = random() % 2 == 0 ? std::nanf("") : static_cast<float>(random() % 100);
    heights(0, 0) = 50;
    EXPECT_EQ(io::without_gaps(heights), without_gaps_by_sweeps(heights));
  }
  EXPECT_TRUE(std::isnan(io::without_gaps(Eigen::MatrixXf::Constant(3, 2, std::nanf("")))(2, 1)));
}

TEST(TerrainLayers, MeanIsThatOfTheSquareAsFarAsTheGridReaches) {
  std::mt19937_64 random = rng();
  Eigen::MatrixXf heights(17, 9);
  for (float& height : heights.reshaped()) height = static_cast<float>(random() % 1000) / 1000;
  for (const double cells : {0.5, 1.0, 3.0, 4.0, 100.0}) {
    const Eigen::MatrixXf mean = io::mean_over(heights, cells);
    const auto reach = static_cast<Eigen::Index>(cells / 2);
    for (Eigen::Index r = 0; r < heights.rows(); ++r)
      for (Eigen::Index c = 0; c < heights.cols(); ++c) {
        const Eigen::Index r0 = std::max<Eigen::Index>(r - reach, 0),
                           r1 = std::min(r + reach, heights.rows() - 1);
        const Eigen::Index c0 = std::max<Eigen::Index>(c - reach, 0),
                           c1 = std::min(c + reach, heights.cols() - 1);
        EXPECT_NEAR(mean(r, c), heights.block(r0, c0, r1 - r0 + 1, c1 - c0 + 1).mean(), 1e-5);
      }
  }
}

}  // namespace
}  // namespace octosurf::test
