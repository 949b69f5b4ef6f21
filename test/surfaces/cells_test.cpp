// Cells of a map's voxels, beside a search through all voxels.
#include "surfaces/cells.hpp"

#include "support/pending_points.hpp"

namespace octosurf::surfaces {
namespace {

using Members = std::map<geometry::VoxelKey, std::vector<PointId>>;

/// Of every cell its voxels, by arithmetic on coordinates.
Members members_of(const test::PendingPoints& points, double edge) {
  Members cells;
  const geometry::VoxelGrid grid(edge);
  for (const PointId i : points.all) {
    geometry::VoxelKey key;
    EXPECT_TRUE(grid.key_of(points.ledger.grid.centre_of(points.ledger.window[i].key), key));
    cells[key].push_back(i);
  }
  return cells;
}

void expect_cells(const test::PendingPoints& points, const Members& members) {
  const Cells& cells = points.ledger.cells;
  ASSERT_EQ(cells.of(points.all).size(), members.size());
  for (const auto& [key, its] : members) {
    const PointId cell = cells.map().window.find(key);
    ASSERT_NE(cell, PointId::none);
    const occupancy::VoxelPoint& point = cells.map().window[cell];
    std::vector<PointId> visited;
    cells.for_each_voxel(cell, [&](PointId i) { visited.push_back(i); });
    EXPECT_TRUE(std::is_permutation(visited.begin(), visited.end(), its.begin(), its.end()));
    EXPECT_EQ(point.position, points.ledger.window[visited.front()].position);
    EXPECT_EQ(point.surface, points.ledger.window[visited.front()].surface);
    const auto with = [&](SurfaceId id) {
      return std::ranges::count_if(its, [&](PointId i) { return points.ledger.window[i].surface == id; });
    };
    for (const PointId i : its) EXPECT_LE(with(points.ledger.window[i].surface), with(point.surface));
    EXPECT_TRUE(point.surface == 0 || with(0) < with(point.surface)) << "pending ones count on a tie";
    EXPECT_EQ(cells.pending_in(cell), static_cast<std::size_t>(with(0)));
  }
}

TEST(Cells, AreThoseOfACoarserGridAndFollowTheirVoxels) {
  for (const double resolution : {0.02, 0.01, 0.005}) {
    SCOPED_TRACE(resolution);
    Scan scan;
    scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 2);
    std::mt19937_64 random = test::rng();
    std::uniform_real_distribution<float> length(-0.1F, 0.1F);
    for (int i = 0; i < 2000; ++i)  // on both sides of the origin
      scan.points.emplace_back(length(random), length(random), 0.2F * length(random) - 2);
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    test::PendingPoints points({scan}, parameters);
    const Members members = members_of(points, 0.02);
    expect_cells(points, members);
    std::vector<SurfaceModel*> surfaces;
    for (int k = 0; k < 2; ++k)
      surfaces.push_back(&points.ledger.create({Eigen::Vector3d::UnitZ(), 0}, {0, 0, 0}));
    for (const PointId i : points.all)
      if (const auto which = random() % 3; which < 2) points.ledger.give(i, *surfaces[which]);
    expect_cells(points, members);
    for (const PointId i : points.all)
      if (points.ledger.window[i].surface != 0 && random() % 2 == 0) points.ledger.requeue(i);
    expect_cells(points, members);
  }
}

TEST(Cells, AreNoWiderThanTwoThirdsOfTheNarrowestSurface) {
  const auto level = [](double resolution, double width) {
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    parameters.surfaces.min_surface_width = width;
    return test::PendingPoints({}, parameters).ledger.cells.map().level;
  };
  EXPECT_EQ(level(0.02, 0.03), 0);
  EXPECT_EQ(level(0.01, 0.03), 1);
  EXPECT_EQ(level(0.005, 0.03), 2);
  EXPECT_EQ(level(0.01, 0.02), 0);
  EXPECT_EQ(level(0.01, 0), 0) << "any width";
  EXPECT_EQ(level(0.005, 0.5), 2) << "a quarter of h";
}

}  // namespace
}  // namespace octosurf::surfaces
