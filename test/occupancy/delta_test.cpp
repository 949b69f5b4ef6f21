// What an insertion says has appeared and vanished, against the sets of occupied voxels before and after.
#include "geometry/morton.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/octomap_twin.hpp"
#include "occupancy/octree_bytes.hpp"
#include "occupancy/payload.hpp"
#include "support/scene.hpp"

namespace octosurf::occupancy {
namespace {

using Keys = std::vector<std::uint64_t>;

Keys minus(const std::set<std::uint64_t>& a, const std::set<std::uint64_t>& b) {
  Keys out;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(out));
  return out;
}
template <class List>
Keys keys_of(const List& list) {
  Keys keys;
  for (const auto& p : list) keys.push_back(p.key.packed());
  std::sort(keys.begin(), keys.end());
  return keys;
}

/// Rays into all directions from a sensor in a room in which a box stands somewhere.
Scan room_with_box(std::mt19937_64& rng, const Eigen::Vector3d& box) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  test::Scene scene;
  scene.box({-1.5, -1.2, 0}, {1.5, 1.2, 1.8}).box(box, box + Eigen::Vector3d(0.4, 0.5, 0.6));
  Scan scan;
  scan.T_map_sensor.translation() = Eigen::Vector3d(-0.9 + 0.2 * uniform(rng), 0.3 * uniform(rng), 1.2);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d ray = Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)).normalized();
    if (const auto range = scene.cast(scan.T_map_sensor.translation(), ray))
      scan.points.push_back((ray * *range).cast<float>());
  }
  return scan;
}

/// The planes of some surfaces, by id.
struct Planes : PlaneLookup {
  std::map<SurfaceId, Plane> planes;
  bool find(SurfaceId id, Plane& plane, double& tolerance) const override {
    const auto at = planes.find(id);
    if (at == planes.end()) return false;
    plane = at->second;
    tolerance = 0.03;
    return true;
  }
};

struct Totals {
  std::size_t appeared = 0, vanished = 0, refined = 0;
};

void check_delta(const OccupancyMap& map, const OccupancyDelta& delta, const std::set<std::uint64_t>& before,
                 const sensing::VoxelScan& scan, const sensing::Downsampler& index) {
  const std::set<std::uint64_t> after = test::occupied_voxels(map);
  EXPECT_EQ(keys_of(delta.appeared), minus(after, before));
  EXPECT_EQ(keys_of(delta.vanished), minus(before, after));
  const auto in_order = [](const VoxelPoint& a, const VoxelPoint& b) {
    return test::morton(a.key) < test::morton(b.key);
  };
  EXPECT_TRUE(std::is_sorted(delta.appeared.begin(), delta.appeared.end(), in_order));
  EXPECT_TRUE(std::is_sorted(delta.vanished.begin(), delta.vanished.end(), in_order));

  const double step = map.grid().resolution() / 512 + 1e-5;
  for (const VoxelPoint& p : delta.appeared) {
    const std::int64_t end = index.find(p.key);
    ASSERT_GE(end, 0) << "nothing ended where it appeared";
    const Eigen::Vector3f centroid = scan.ends[static_cast<std::size_t>(end)].centroid;
    EXPECT_LE((p.position - centroid).cwiseAbs().maxCoeff(), step);
    EXPECT_GT(p.view.dot((scan.origin - centroid).normalized()), 0.9976F);  // 3.9°
    EXPECT_EQ(p.surface, 0U);
    ASSERT_TRUE(map.at(p.key).point);
    EXPECT_EQ(map.at(p.key).point->position, p.position);
  }
  for (const VoxelPoint& p : delta.vanished) EXPECT_FALSE(map.at(p.key).point);
  for (const auto& [was, now] : delta.refined) {
    EXPECT_EQ(was.key, now.key);
    EXPECT_EQ(was.surface, now.surface);
    EXPECT_LT(now.range_class, was.range_class) << "refined by a view that is not nearer";
    EXPECT_TRUE(before.contains(was.key.packed()) && after.contains(was.key.packed()));
    EXPECT_EQ(map.at(now.key).point->position, now.position);
  }
  // Every occupied voxel keeps one point.
  EXPECT_EQ(keys_of(test::points_of(map)), Keys(after.begin(), after.end()));
}

Totals run(std::uint64_t seed, bool with_planes, OccupancyParameters parameters) {
  std::mt19937_64 rng(seed);
  OccupancyMap map(parameters);
  sensing::Downsampler downsample(map.grid());
  Planes planes;
  planes.planes[5] = {Eigen::Vector3d::UnitZ(), 0};
  Eigen::Vector3d box(0.2, 0, 0);
  Totals totals;
  for (int i = 0; i < 24; ++i) {
    if (i % 8 == 7) box = Eigen::Vector3d(0.2 + 0.1 * (i % 5), -0.6 + 0.05 * i, 0);  // it is carried away
    const Scan scan = room_with_box(rng, box);
    const std::set<std::uint64_t> before = test::occupied_voxels(map);
    const sensing::VoxelScan voxels = downsample(scan, 0, i % 4 == 0 ? 1.3 : 5);
    const OccupancyDelta delta = map.insert(voxels, downsample, with_planes ? &planes : nullptr);
    check_delta(map, delta, before, voxels, downsample);
    totals.appeared += delta.appeared.size();
    totals.vanished += delta.vanished.size();
    totals.refined += delta.refined.size();
    if (with_planes)
      for (const VoxelPoint& p : delta.appeared)
        if (std::fabs(p.position.z()) < 0.02F) map.assign(p, 5);
  }
  return totals;
}

TEST(OccupancyDelta, IsTheDifferenceOfTheOccupiedVoxels) {
  for (const bool with_planes : {false, true}) {
    const Totals totals = run(test::seed(), with_planes, test::with_resolution(0.05));
    EXPECT_GT(totals.appeared, 1000U);
    EXPECT_GT(totals.vanished, 50U) << "nothing vanished: the test tests nothing";
    EXPECT_GT(totals.refined, 10U);
  }
}

TEST(OccupancyDelta, FollowsTheOccupancyThreshold) {
  const Totals totals = run(test::seed(), false, test::with_resolution(0.05, 0.75));  // one hit is not enough
  EXPECT_GT(totals.appeared, 500U);
  EXPECT_GT(totals.vanished, 50U);
}

}  // namespace
}  // namespace octosurf::occupancy
