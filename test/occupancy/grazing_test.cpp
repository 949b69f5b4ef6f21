// Which misses count in a surface's voxels: the binned test against all rays.
#include "occupancy/grazing.hpp"

#include "occupancy/occupancy_map.hpp"
#include "occupancy/octree_bytes.hpp"
#include "support/random_scans.hpp"

namespace octosurf::occupancy {
namespace {

constexpr double d = 0.05, tolerance = 0.04;

struct Ray {
  Eigen::Vector3d from, to;
};

std::vector<Ray> rays_of(const sensing::VoxelScan& scan, const geometry::VoxelGrid& grid) {
  std::vector<Ray> rays;
  for (const sensing::EndVoxel& end : scan.ends) {
    const Eigen::Vector3d centre = grid.centre_of(end.key).cast<double>(), from = scan.origin.cast<double>();
    rays.push_back({from, scan.within_range(end, grid.centre_of(end.key))
                              ? centre
                              : Eigen::Vector3d(from + (centre - from).normalized() * scan.max_range)});
  }
  return rays;
}

/// Any ray at all, with voxels a little larger or smaller and the plane a little nearer or farther.
bool crossed(const std::vector<Ray>& rays, const Eigen::Vector3d& centre, const Plane& plane, double slack) {
  for (const Ray& ray : rays) {
    const double from = plane.signed_distance(ray.from), to = plane.signed_distance(ray.to);
    const bool beyond = from > 0 ? to < -tolerance + slack : to > tolerance - slack;
    if (const auto [enter, leave] = test::part_in_cube(ray.from, ray.to, centre, d / 2 + slack);
        beyond && enter <= leave)
      return true;
  }
  return false;
}

TEST(GrazingTest, EqualsBruteForceOverAllRays) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  const geometry::VoxelGrid grid(d);
  sensing::Downsampler downsample(grid);
  std::size_t yes = 0, no = 0;
  for (int round = 0; round < 12; ++round) {
    const Eigen::Vector3d origin(uniform(rng), uniform(rng), uniform(rng));
    const sensing::VoxelScan scan =
        downsample(test::rays_around(rng, origin, round % 2 == 0 ? 300 : 3000, 0.3, 2.8), 0, 2.0);
    const std::vector<Ray> rays = rays_of(scan, grid);
    GrazingTest grazing(scan, grid);
    for (int i = 0; i < 800; ++i) {
      Plane plane{Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized(), 0};
      const double reach = i % 4 == 0 ? 0.25 : i % 4 == 1 ? 0.1 : 2;  // near the sensor and farther away
      const Eigen::Vector3d at = origin + reach * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
      plane.offset = plane.normal.dot(at);
      geometry::VoxelKey voxel;
      ASSERT_TRUE(grid.key_of(at.cast<float>(), voxel));
      const Eigen::Vector3d centre = grid.centre_of(voxel).cast<double>();
      if ((centre - origin).cwiseAbs().maxCoeff() <= d / 2 + 1e-4) continue;  // the sensor's own voxel
      const bool surely = crossed(rays, centre, plane, -1e-5), perhaps = crossed(rays, centre, plane, 1e-5);
      if (surely != perhaps) continue;
      ++(surely ? yes : no);
      EXPECT_EQ(grazing.crosses(voxel, plane, tolerance), surely)
          << "round " << round << " voxel " << centre.transpose() << " origin " << origin.transpose()
          << " normal " << plane.normal.transpose() << " offset " << plane.offset;
    }
  }
  EXPECT_GT(yes, 500U);
  EXPECT_GT(no, 500U);
  const sensing::VoxelScan no_rays;
  EXPECT_FALSE(
      GrazingTest(no_rays, grid).crosses({32800, 32768, 32768}, {Eigen::Vector3d::UnitZ(), 0}, tolerance));
}

struct Floor : PlaneLookup {
  bool find(SurfaceId id, Plane& plane, double& s) const override {
    plane = {Eigen::Vector3d::UnitZ(), 0};
    s = tolerance;
    return id == 7;
  }
};

/// A floor 3 m × 2 m at z = 0, seen from above often enough to be sure, all of it surface 7.
OccupancyMap seen_floor(sensing::Downsampler& downsample) {
  OccupancyMap map(test::with_resolution(d));
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d(0, 0, 1.5);
  for (double x = -1.5; x < 1.5; x += 0.02)
    for (double y = -1; y < 1; y += 0.02)
      scan.points.push_back(Eigen::Vector3d(x, y, 0.001 - 1.5).cast<float>());
  const OccupancyDelta delta = map.insert(downsample(scan, 0, 10), downsample, nullptr);
  for (const VoxelPoint& p : delta.appeared) map.assign(p, 7);
  return map;
}

TEST(PreserveSurfaces, MissesCountExactlyWhereSomeRayCrosses) {
  // A floor that was seen often, then random rays: log-odds fall where and only where brute force says.
  std::mt19937_64 rng = test::rng();
  sensing::Downsampler downsample{geometry::VoxelGrid(d)};
  const Floor floor;
  std::size_t fell = 0, stayed = 0;
  for (int round = 0; round < 6; ++round) {
    OccupancyMap map = seen_floor(downsample), free = seen_floor(downsample);
    const sensing::VoxelScan voxels =
        downsample(test::rays_around(rng, {0.15 * round, -0.1, 0.1 + 0.1 * round}, 800, 0.3, 2.8), 0, 2);
    const std::vector<Ray> rays = rays_of(voxels, map.grid());
    std::map<std::uint64_t, float> before;
    map.for_each_point([&](const VoxelPoint& p) { before[p.key.packed()] = map.at(p.key).log_odds; });
    map.insert(voxels, downsample, &floor);
    free.insert(voxels, downsample, nullptr);
    for (const auto& [packed, was] : before) {
      const geometry::VoxelKey key = geometry::VoxelKey::unpack(packed);
      const float now = map.at(key).log_odds, unpreserved = free.at(key).log_odds;
      const Eigen::Vector3d centre = map.grid().centre_of(key).cast<double>();
      const Plane plane{Eigen::Vector3d::UnitZ(), 0};
      const bool surely = crossed(rays, centre, plane, -1e-5), perhaps = crossed(rays, centre, plane, 1e-5);
      if (surely != perhaps) continue;
      const float expected = unpreserved < was && !surely ? was : unpreserved;
      ++(now < was ? fell : stayed);
      EXPECT_EQ(now, expected) << "at " << centre.transpose();
    }
  }
  EXPECT_GT(fell, 50U);
  EXPECT_GT(stayed, 1000U);
}

}  // namespace
}  // namespace octosurf::occupancy
