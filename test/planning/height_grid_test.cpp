// Height grids against every cell's centre asked of every surface by itself.
#include "io/exporters/room_snapshot.hpp"
#include "shapes.hpp"
#include "support/polygons.hpp"

#include <octosurf/height_grid.hpp>
#include <octosurf/up.hpp>

namespace octosurf::planning {
namespace {

Snapshot random_surfaces(std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-3, 3), angle(-std::numbers::pi, std::numbers::pi);
  Snapshot snapshot;
  snapshot.resolution = 0.05;
  for (SurfaceId id = 1; id <= 12; ++id) {
    Eigen::Isometry3d T(Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitZ()) *
                        Eigen::AngleAxisd(angle(random) / 6, Eigen::Vector3d::UnitX()) *
                        Eigen::AngleAxisd(id % 4 == 0 ? shapes::pi : 0.0, Eigen::Vector3d::UnitX()));
    T.translation() = Eigen::Vector3d(place(random), place(random), place(random));
    snapshot.surfaces.push_back(
        std::make_shared<const Surface>(shapes::surface(id, {shapes::random_polygon(random)}, T)));
  }
  return snapshot;
}

/// Where a vertical line meets the surface's plane, in its frame; z is the height.
Eigen::Vector3d met(const Surface& surface, const Eigen::Quaterniond& turn, const Eigen::Vector2d& at) {
  const Eigen::Vector3d n = turn * surface.plane.normal;
  const double z = (surface.plane.offset - n.head<2>().dot(at)) / n.z();
  const Eigen::Vector3d in_surface =
      surface.T_map_surface.inverse() * (turn.conjugate() * Eigen::Vector3d(at.x(), at.y(), z));
  return {in_surface.x(), in_surface.y(), z};
}

TEST(HeightGrid, EqualsAskingEverySurfaceAtEveryCell) {
  std::mt19937_64 random = test::rng();
  for (int round = 0; round < 6; ++round) {
    const Snapshot snapshot = random_surfaces(random);
    HeightGridOptions options;
    options.cell = 0.13;
    options.turn = upright(Eigen::Vector3d(0.05 * round, -0.1, 1));
    if (round % 2 == 1) options.below = 0.5;
    const HeightGrid grid = height_grid(snapshot, options);
    ASSERT_GT(grid.elevation.size(), 100);
    std::vector<test::Region> regions;
    for (const SurfacePtr& surface : snapshot.surfaces) regions.emplace_back(surface->polygons);
    for (Eigen::Index row = 0; row < grid.elevation.rows(); ++row)
      for (Eigen::Index column = 0; column < grid.elevation.cols(); ++column) {
        const Eigen::Vector2d at = grid.center_of(row, column);
        double best = -1e9;
        const Surface* highest = nullptr;
        for (std::size_t i = 0; i < snapshot.surfaces.size(); ++i) {
          const Surface& surface = *snapshot.surfaces[i];
          if (slope_rad(surface, options.turn.conjugate() * Eigen::Vector3d::UnitZ()) > options.max_slope_rad)
            continue;
          const Eigen::Vector3d uvz = met(surface, options.turn, at);
          if (uvz.z() <= best || (options.below && uvz.z() > *options.below)) continue;
          if (!regions[i].covers(uvz.head<2>())) continue;
          best = uvz.z();
          highest = &surface;
        }
        const float elevation = grid.elevation(row, column);
        ASSERT_EQ(std::isnan(elevation), highest == nullptr);
        if (highest == nullptr) continue;
        EXPECT_NEAR(elevation, best, 1e-6);
        EXPECT_EQ(grid.surface(row, column), static_cast<double>(highest->id));
        const Eigen::Vector3d n = options.turn * highest->plane.normal;
        for (Eigen::Index axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(grid.normal[static_cast<std::size_t>(axis)](row, column), n[axis], 1e-6);
      }
  }
}

TEST(HeightGrid, CellsBeginAtMultiplesOfTheirSizeAndCoverAllThatIsLevel) {
  const Snapshot room = test::make_room();
  HeightGridOptions options;
  options.cell = 0.07;
  const HeightGrid grid = height_grid(room, options);
  const Eigen::Vector2d half = grid.center -
                               grid.center_of(grid.elevation.rows() - 1, grid.elevation.cols() - 1) +
                               Eigen::Vector2d::Constant(grid.cell / 2);
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(grid.center - half), Eigen::Vector2d(grid.center + half)})
    for (const double x : corner) EXPECT_NEAR(x / 0.07, std::round(x / 0.07), 1e-9);
  EXPECT_LE((grid.center - half).maxCoeff(), 1e-9);
  EXPECT_GE((grid.center + half).x(), 6 - 1e-9);
  EXPECT_GE((grid.center + half).y(), 4 - 1e-9);
}

TEST(HeightGrid, PartIsCutOutOfTheWhole) {
  const Snapshot room = test::make_room();
  HeightGridOptions options;
  options.within = {Eigen::Vector2d(1.01, -5), Eigen::Vector2d(2.5, 2.2)};
  const HeightGrid all = height_grid(room), part = height_grid(room, options);
  EXPECT_EQ(part.elevation.rows(), 75);  // 1.0 to 2.5 m
  EXPECT_LT(part.elevation.cols(), all.elevation.cols());
  for (Eigen::Index row = 0; row < part.elevation.rows(); ++row)
    for (Eigen::Index column = 0; column < part.elevation.cols(); ++column) {
      const Eigen::Vector2d off = (all.center_of(0, 0) - part.center_of(row, column)) / all.cell;
      const auto at = [&](Eigen::Index axis) { return static_cast<Eigen::Index>(std::lround(off[axis])); };
      ASSERT_EQ(part.surface(row, column), all.surface(at(0), at(1)));
      ASSERT_EQ(part.elevation(row, column), all.elevation(at(0), at(1)));
    }
  options.within = {Eigen::Vector2d(100, 100), Eigen::Vector2d(101, 101)};
  EXPECT_EQ(height_grid(room, options).elevation.size(), 0);
}

TEST(HeightGrid, ResolutionIsTheMapsUnlessGiven) {
  EXPECT_EQ(height_grid(test::make_room()).cell, 0.02);
  EXPECT_EQ(height_grid(test::make_room()).elevation.rows(), 300);
}

TEST(HeightGrid, WithoutLevelSurfacesThereAreNoCells) {
  EXPECT_EQ(height_grid({}).elevation.size(), 0);
  Snapshot wall = test::make_room();
  wall.surfaces.erase(wall.surfaces.begin(), wall.surfaces.begin() + 2);
  wall.surfaces.resize(4);
  EXPECT_EQ(height_grid(wall).elevation.size(), 0);
}

TEST(HeightGrid, OptionsThatMakeNoSenseAreRefused) {
  const Snapshot room = test::make_room();
  const auto refused = [&](double cell, double slope, double below) {
    HeightGridOptions options;
    options.cell = cell;
    options.max_slope_rad = slope;
    options.below = below;
    EXPECT_THROW(height_grid(room, options), Error);
  };
  refused(-1, 0.5, 0);
  refused(std::nan(""), 0.5, 0);
  refused(1e-4, 0.5, 0);  // 2.4 · 10⁹ cells
  refused(0.1, std::numbers::pi / 2, 0);
  refused(0.1, -0.1, 0);
  refused(0.1, 0.5, std::nan(""));
}

}  // namespace
}  // namespace octosurf::planning
