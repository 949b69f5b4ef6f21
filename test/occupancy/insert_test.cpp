// The batched insertion against OctoMap's own, its slow and obvious twin.
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "occupancy/octree_bytes.hpp"
#include "support/paths.hpp"
#include "support/random_scans.hpp"

#include <octosurf/scan_source.hpp>

namespace octosurf::occupancy {
namespace {

/// Its planes are asked for in voxels of surfaces, and there are none.
struct NoPlane : PlaneLookup {
  bool find(SurfaceId, Plane&, double&) const override { return ADD_FAILURE(), false; }
};

/// All maps of the same scans: the slow one, ours by one thread and by two and three in turn, which would
/// look for planes; `max_range` < 0: unlimited.
template <class InsertSlowly>
void compare(const std::vector<Scan>& scans, double resolution, double max_range,
             const InsertSlowly& insert_slowly) {
  SCOPED_TRACE("resolution " + std::to_string(resolution) + " max_range " + std::to_string(max_range));
  OccupancyMap ours(test::with_resolution(resolution)), by_threads(test::with_resolution(resolution));
  octomap::OcTree theirs(resolution);
  const NoPlane no_plane;
  sensing::Downsampler downsample(ours.grid());
  int threads = 2;
  for (const Scan& scan : scans) {
    insert_slowly(theirs, scan, max_range);
    const sensing::VoxelScan voxels =
        downsample(scan, 0, max_range < 0 ? std::numeric_limits<double>::infinity() : max_range);
    EXPECT_EQ(voxels.starts.size() > 5, !scan.origins.empty());
    ours.insert(voxels, downsample, nullptr);
    by_threads.insert(voxels, downsample, &no_plane, threads);
    threads = 5 - threads;
  }
  test::expect_equal(ours, theirs);
  test::expect_equal(by_threads, theirs);
}
void compare(const std::vector<Scan>& scans, double resolution, double max_range) {
  compare(scans, resolution, max_range, test::insert_scan);
}

std::vector<Scan> simulated(std::mt19937_64 rng, std::size_t rays, double shift) {
  std::vector<Scan> scans;
  for (int i = 0; i < 4; ++i)
    scans.push_back(test::room_scan(rng, rays, {2.1, 1.7, 1.3}, Eigen::Vector3d(shift, -shift, shift)));
  return scans;
}

/// Every `stride`-th scan of a recording, `count` of them; empty if it is not there.
std::vector<Scan> recorded(const std::string& name, const std::string& poses, std::size_t stride,
                           std::size_t count) {
  const std::filesystem::path folder = std::filesystem::path(test::paths::data()) / name;
  std::vector<Scan> scans;
  if (!std::filesystem::exists(folder)) return scans;
  ScanSourceOptions options;
  if (!poses.empty()) options.poses = folder / poses;
  const auto source = open_scans({folder}, options);
  for (std::size_t i = 0; scans.size() < count; ++i) {
    auto scan = source->next();
    if (!scan) break;
    if (i % stride == 0) scans.push_back(std::move(*scan));
  }
  return scans;
}

TEST(OccupancyInsert, EqualsOctomapOnSimulatedScans) {
  for (const double resolution : {0.01, 0.02, 0.05, 0.11})
    for (const double max_range : {-1.0, 1.5})
      compare(simulated(test::rng(), resolution < 0.02 ? 500 : 2000, 0), resolution, max_range);
}

TEST(OccupancyInsert, RaysFromAnywherePassOctomapsVoxels) {
  std::mt19937_64 rng(test::seed());
  std::uniform_real_distribution<double> anywhere(-20, 20);
  std::vector<Scan> scans{Scan()};
  for (int i = 0; i < 4; ++i)
    scans.push_back(test::rays_around(rng, {anywhere(rng), anywhere(rng), anywhere(rng)}, 1200, 0.01,
                                      i % 2 == 0 ? 1.5 : 3));
  for (const double resolution : {0.02, 0.03, 0.04, 0.05}) compare(scans, resolution, -1);
  for (const double max_range : {0.5, 1.3}) {
    compare(scans, 0.05, max_range);
    // From a voxel's centre, where every comparison is a tie.
    compare({test::rays_around(rng, {0.025, 0.025, 0.025}, 400, 0.1, 3)}, 0.05, max_range);
  }
  for (int i = 0; i < 60; ++i)
    scans.push_back(test::rays_around(rng, {anywhere(rng), anywhere(rng), anywhere(rng)}, 40, 0.01, 1));
  compare(scans, 0.05, 0.03);  // hardly beyond the sensor's own voxel
}

/// Of a block at the border of the box that is passed over, what lies outside was once a second block, and
/// lost.
TEST(OccupancyInsert, FarRaysPassOctomapsVoxels) {
  std::mt19937_64 rng(test::seed());
  const Eigen::Vector3d origin(1.01, -2.02, 0.53);
  Scan scan = test::rays_around(rng, origin, 300, 0.1, 3);
  for (const Eigen::Vector3f& stray : test::rays_around(rng, origin, 12, 250, 640).points)
    scan.points.push_back(stray);
  compare({scan}, 0.02, -1);
  // A box too large to pass over.
  compare({test::rays_around(rng, {-7.3, 4.4, 12.2}, 400, 0.5, 11)}, 0.02, -1);
}

TEST(OccupancyModel, ClampsWhatIsHitAgainAndAgainAsOctomapDoes) {
  std::mt19937_64 rng(test::seed());
  compare(std::vector<Scan>(8, test::room_scan(rng, 100, {0.5, 0.4, 0.3})), 0.1, -1);
}

TEST(OccupancyInsert, EqualsOctomapFarFromTheOrigin) {
  compare(simulated(test::rng(), 1500, 97.31), 0.02, -1);
  compare(simulated(test::rng(), 3000, -611.7), 0.05, 1.5);
}

/// The rays of a scan in which the sensor moved, by 0.4 m at most and back a little.
Scan moving_scan(std::mt19937_64& rng) {
  Scan scan = test::room_scan(rng, 4000, {2.1, 1.7, 1.3});
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(scan.points.size());
    scan.origins.emplace_back(0.4F * t, 0.1F * std::sin(6 * t), -0.05F * t);
  }
  return scan;
}

TEST(OccupancyInsert, ScansOfAMovingSensorEqualOctomapsStartByStart) {
  std::mt19937_64 rng = test::rng();
  for (const double resolution : {0.02, 0.05})
    for (const double max_range : {-1.0, 1.5})
      compare({moving_scan(rng), moving_scan(rng), moving_scan(rng)}, resolution, max_range,
              test::insert_moving_scan);
}

TEST(OccupancyInsert, ScansWithAllStartsAtTheSensorAreAsWithout) {
  std::mt19937_64 rng = test::rng();
  Scan scan = test::room_scan(rng, 4000, {2.1, 1.7, 1.3});
  const auto octree_of = [](const Scan& inserted) {
    OccupancyMap map{OccupancyParameters{}};
    test::insert(map, inserted, 1.5);
    return test::bytes_of(map);
  };
  const std::string without = octree_of(scan);
  scan.origins.assign(scan.points.size(), Eigen::Vector3f::Zero());
  EXPECT_EQ(octree_of(scan), without);
}

TEST(OccupancyInsert, FreeRaysMissWhatTheyPassAndHitNothing) {
  std::mt19937_64 rng = test::rng();
  const auto with_free_rays = [&] {
    Scan scan = test::room_scan(rng, 3000, {2.1, 1.7, 1.3});
    for (const Eigen::Vector3f& p : test::room_scan(rng, 1000, {2.1, 1.7, 1.3}).points)
      scan.free_rays.push_back(1.2F * p);  // through the walls
    scan.free_rays.push_back(scan.points[0]);
    scan.free_rays.push_back(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    return scan;
  };
  for (const double resolution : {0.02, 0.05})
    compare({with_free_rays(), with_free_rays(), with_free_rays()}, resolution, 1.9F,
            test::insert_with_free_rays);
}

TEST(OccupancyInsert, EqualsOctomapOnRealDepthImages) {
  const std::vector<Scan> scans = recorded("rgbd_7scenes_redkitchen", "", 40, 2);
  if (scans.empty()) GTEST_SKIP() << "no rgbd_7scenes_redkitchen";
  compare(scans, 0.1, -1);
  compare({scans.back()}, 0.03, 4);
  compare({scans.front()}, 0.01, 1.5);
}

TEST(OccupancyInsert, EqualsOctomapOnRealLidar) {
  const std::vector<Scan> scans = recorded("lidar_balm_realworld", "poses_subset.csv", 5, 2);
  if (scans.empty()) GTEST_SKIP() << "no lidar_balm_realworld";
  compare(scans, 0.1, 8);
  compare({scans.front()}, 0.1, -1);
}

// OctoMap is no twin here: its rays overrun their buffer.
TEST(OccupancyInsert, ScansAtTheBorderEndAtTheLastVoxel) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double d = 0.05, border = d * 32768;
  for (const double max_range : {std::numeric_limits<double>::infinity(), 0.7})
    for (int corner = 0; corner < 8; ++corner) {
      OccupancyMap map(test::with_resolution(d));
      sensing::Downsampler downsample(map.grid());
      Scan scan;
      for (int a = 0; a < 3; ++a)
        scan.T_map_sensor.translation()[a] =
            ((corner >> a & 1) ? 1 : -1) * (border - 0.06 - 0.5 * std::fabs(uniform(rng)));
      for (int k = 0; k < 500; ++k)
        scan.points.push_back(
            (Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized() * (1.2 + uniform(rng)))
                .cast<float>());
      const sensing::VoxelScan voxels = downsample(scan, 0, max_range);
      EXPECT_GT(voxels.out_of_map, 0U);
      const OccupancyDelta delta = map.insert(voxels, downsample, nullptr);

      std::size_t hits = 0;
      for (const sensing::EndVoxel& end : voxels.ends)
        if (voxels.within_range(end, map.grid().centre_of(end.key))) {
          ++hits;
          EXPECT_EQ(map.at(end.key).state, OccupancyMap::State::occupied);
        }
      EXPECT_EQ(delta.appeared.size(), hits);
      // Nothing is known beyond the rays: no step wrapped around to the other side.
      const octomap::OcTree known = test::through_bt(map);
      for (auto leaf = known.begin_leafs(); leaf != known.end_leafs(); ++leaf) {
        const octomap::point3d c = leaf.getCoordinate();
        const double farthest = std::min(max_range, 2.2) + leaf.getSize() + 2 * d;
        EXPECT_LE((Eigen::Vector3d(c.x(), c.y(), c.z()) - scan.T_map_sensor.translation()).norm(), farthest);
      }
    }
}

}  // namespace
}  // namespace octosurf::occupancy
