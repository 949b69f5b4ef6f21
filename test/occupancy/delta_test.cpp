// What an insertion says has appeared and vanished, against the sets of occupied voxels before and after.
#include "geometry/morton.hpp"
#include "geometry/voxel_grid.hpp"
#include "occupancy/block_bits.hpp"
#include "occupancy/grazing.hpp"
#include "occupancy/octomap_twin.hpp"
#include "occupancy/payload.hpp"
#include "occupancy/walk_lanes.hpp"
#include "support/random_scans.hpp"
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

// Which misses count in a surface's voxels: the binned test against all rays.

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

// Rays walked side by side set the bits that each sets alone.

/// The bits that LaneWalker sets for the rays.
std::vector<std::uint64_t> walked(const GridOrigin& from, std::span<const GridRay> rays, bool paged,
                                  bool side_by_side) {
  BlockAddress address;
  KeyBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.low[a] = from.key[a] - 60;
    box.high[a] = from.key[a] + 60;
  }
  address.fit(box);
  std::vector<std::uint64_t> bits(std::size_t{1} << (address.size_bits - 6));
  std::vector<std::uint8_t> pages(std::size_t{1} << (address.size_bits - 15));
  LaneWalker walker({bits.data(), paged ? pages.data() : nullptr, address.mask},
                    address.of(from.key[0], from.key[1], from.key[2]));
  std::size_t i = 0;
  const auto next = [&](GridWalk& out) {
    if (i == rays.size()) return false;
    out = GridWalk(rays[i++], from);
    return true;
  };
  walker.run(next, side_by_side);
  for (std::size_t page = 0; paged && page < pages.size(); ++page) {
    const auto first = bits.begin() + static_cast<std::ptrdiff_t>(512 * page);
    EXPECT_EQ(pages[page] != 0, std::any_of(first, first + 512, [](std::uint64_t w) { return w != 0; }));
  }
  return bits;
}

TEST(LaneWalker, SetsTheSameBitsSideBySide) {
#ifdef OCTOSURF_HAS_LANES
  const bool side_by_side = __builtin_cpu_supports("avx2");
#else
  const bool side_by_side = false;
#endif
  if (!side_by_side) GTEST_SKIP() << "this processor walks one ray at a time";
  std::mt19937_64 rng(test::seed());
  std::uniform_int_distribution<int> voxels(-55, 55);
  const geometry::VoxelGrid grid(0.02);
  const GridOrigin from{{0.313F, -0.207F, 1.011F}, {32783, 32757, 32818}, 0.02};
  for (const std::size_t n : {0U, 1U, 5U, 8U, 300U}) {
    std::vector<GridRay> rays(n);
    for (GridRay& ray : rays)
      for (std::size_t a = 0; a < 3; ++a) {
        ray.key[a] = static_cast<std::uint16_t>(from.key[a] + voxels(rng));
        ray.end[a] = grid.centre_of(ray.key[a]);
      }
    for (const bool paged : {false, true})
      EXPECT_TRUE(walked(from, rays, paged, true) == walked(from, rays, paged, false));
  }
}

// The batched insertion against OctoMap's own, its slow and obvious twin.

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

// OctoMap is no twin here: its rays overrun their buffer.
TEST(OccupancyInsert, ScansAtTheBorderEndAtTheLastVoxel) {
  std::mt19937_64 rng = test::rng();
  std::uniform_real_distribution<double> uniform(-1, 1);
  constexpr double border = d * 32768;
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
