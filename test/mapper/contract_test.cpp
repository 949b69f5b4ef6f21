// What the headers promise of Mapper, Map and Snapshot, whatever the scene.
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/room_tour.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include <octosurf/error.hpp>

namespace octosurf::mapper {
namespace {

using test::CheckedMapper;
using test::Scene;

void insert_all(Mapper& mapper, const std::vector<Scan>& scans) {
  for (const Scan& scan : scans) mapper.insert(scan);
}

TEST(MapperContract, AScanThatCouldUseUpTheIdsIsRefusedUntouched) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 4);
  Mapper before;
  insert_all(before, {scans.begin(), scans.begin() + 2});
  Map map = std::move(before).release();
  map.state().surfaces.set_next_id(0xffffff);  // one is left, as a map file may say
  Mapper mapper(std::move(map));
  const std::string stood = test::digest(mapper.map());
  const auto snapshot = mapper.snapshot();
  for (const Scan& scan : {scans[2], scans[3], Scan()}) {
    EXPECT_THROW(mapper.insert(scan), Error);
    EXPECT_TRUE(test::digest(mapper.map()) == stood);
    EXPECT_EQ(mapper.snapshot(), snapshot);
    EXPECT_THAT(check_invariants(mapper.map()), ::testing::IsEmpty());
  }
}

TEST(MapperContract, ThreadsThatAreRefusedLeaveTheCallerItsMap) {
  Mapper before;
  insert_all(before, test::room_tour(test::rng(), 2));
  Map map = std::move(before).release();
  const std::string stood = test::digest(map);
  for (const int threads : {0, -1, 257}) EXPECT_THROW(Mapper(std::move(map), threads), Error) << threads;
  EXPECT_TRUE(test::digest(map) == stood);
  EXPECT_TRUE(test::digest(Mapper(std::move(map), 2).map()) == stood);
}

TEST(MapperContract, ScansThatSayNothingChangeNothing) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  CheckedMapper under_test;
  Scan empty;
  ScanReport report = under_test.insert(empty);
  EXPECT_EQ(report.points_raw, 0U);
  EXPECT_EQ(report.voxels, 0U);
  EXPECT_TRUE(under_test.surfaces().empty());
  for (const Scan& scan : test::room_tour(test::rng(), 3)) under_test.insert(scan);
  const Map::Size before = under_test.mapper.map().size();
  const auto surfaces = under_test.surfaces();
  under_test.insert(empty);
  empty.points.assign(500, Eigen::Vector3f(nan, 0, 1));
  report = under_test.insert(empty);
  EXPECT_EQ(report.points_not_finite, 500U);
  EXPECT_EQ(report.appeared + report.vanished, 0U);
  EXPECT_EQ(under_test.mapper.map().size().nodes, before.nodes);
  EXPECT_EQ(under_test.mapper.map().size().points, before.points);
  EXPECT_EQ(under_test.surfaces(), surfaces) << "nor are they published anew";
}

TEST(MapperContract, DroppedPointsAreCounted) {
  Parameters parameters;
  parameters.occupancy.min_range = 0.5;
  parameters.occupancy.max_range = 3;
  CheckedMapper under_test(parameters);
  Scan scan;
  const float edge = 0.02F * 32768;
  for (int i = 0; i < 5; ++i) scan.points.emplace_back(0.1F, 0, 0.1F * static_cast<float>(i));
  for (int i = 0; i < 7; ++i) scan.points.emplace_back(edge + 1 + static_cast<float>(i), 0, 0);
  for (int i = 0; i < 9; ++i) scan.points.emplace_back(0, 5 + 0.1F * static_cast<float>(i), 0);
  for (int i = 0; i < 11; ++i) scan.points.emplace_back(0, -2 - 0.05F * static_cast<float>(i), 0);
  scan.points.emplace_back(std::numeric_limits<float>::infinity(), 0, 0);
  const ScanReport report = under_test.insert(scan);
  EXPECT_EQ(report.points_raw, 33U);
  EXPECT_EQ(report.points_too_near, 5U);
  EXPECT_EQ(report.points_out_of_map, 7U);
  EXPECT_EQ(report.points_beyond_range, 9U);
  EXPECT_EQ(report.points_not_finite, 1U);
  EXPECT_EQ(report.appeared, 11U);
  using O = Map::Occupancy;
  EXPECT_EQ(under_test.mapper.map().at({0, 2.9, 0}).occupancy, O::free)
      << "points beyond free what is before them";
  EXPECT_EQ(under_test.mapper.map().at({0, 5, 0}).occupancy, O::unknown);
  EXPECT_EQ(under_test.mapper.map().at({0, -2, 0}).occupancy, O::occupied);
  EXPECT_EQ(under_test.mapper.map().at({1e9, 0, 0}).occupancy, O::unknown);
}

TEST(MapperContract, SensorsPickTheirRange) {
  Scan scan;
  scan.points = {{0, 0, 10}};
  Mapper camera, lidar;
  scan.sensor = SensorKind::depth_camera;
  EXPECT_EQ(camera.insert(scan).points_beyond_range, 1U);
  EXPECT_EQ(camera.map().size().points, 0U);
  scan.sensor = SensorKind::lidar;
  EXPECT_EQ(lidar.insert(scan).points_beyond_range, 0U);
  EXPECT_EQ(lidar.map().size().points, 1U);
}

TEST(MapperContract, AScanSeenTwiceChangesNoSurface) {
  const std::vector<Scan> scans = test::room_tour(test::rng(), 3);
  CheckedMapper under_test;
  for (const Scan& scan : scans) under_test.insert(scan);
  const auto before = under_test.surfaces();
  const ScanReport report = under_test.insert(scans.back());
  EXPECT_EQ(report.appeared, 0U);
  const auto after = under_test.surfaces();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i]->id, before[i]->id);
    EXPECT_NEAR(after[i]->area_m2, before[i]->area_m2, 0.03 * before[i]->area_m2 + 0.002);
  }
}

TEST(MapperContract, ChangedSinceTellsWhatTheSnapshotsDifferIn) {
  Mapper mapper;
  for (const Scan& scan : test::room_tour(test::rng(), 8)) {
    const auto before = mapper.snapshot();
    mapper.insert(scan);
    const auto after = mapper.snapshot();
    std::vector<SurfacePtr> different;
    for (const SurfacePtr& s : after->surfaces)
      if (before->find(s->id) != s.get()) different.push_back(s);
    EXPECT_EQ(after->changed_since(before->revision), different);
    EXPECT_EQ(after->changed_since(0), after->surfaces);
    EXPECT_TRUE(after->changed_since(after->revision).empty());
  }
}

TEST(MapperContract, IdsAreNeverUsedAgain) {
  // A plate comes and goes three times.
  std::mt19937_64 rng = test::rng();
  Scene with, without;
  without.rectangle({-1, -1, 0.01}, {2, 0, 0}, {0, 2, 0});
  with = without;
  with.rectangle({-0.3, -0.3, 0.4}, {0.6, 0, 0}, {0, 0.6, 0});
  const Eigen::Isometry3d pose = test::look_at({0.1, 0.1, 1.8}, {0, 0, 0});
  CheckedMapper under_test;
  std::set<SurfaceId> seen;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i)
      under_test.insert(test::camera_scan(with, pose, rng));  // from free to occupied
    const auto plate = under_test.on_plane({0, 0, 1}, {0, 0, 0.4});
    ASSERT_EQ(plate.size(), 1U);
    EXPECT_TRUE(seen.insert(plate[0]->id).second) << "an id came back";
    for (int i = 0; i < 15; ++i) under_test.insert(test::camera_scan(without, pose, rng));
    EXPECT_TRUE(under_test.on_plane({0, 0, 1}, {0, 0, 0.4}).empty());
  }
}

TEST(MapperContract, ReportsItsTime) {
  Mapper mapper;
  double largest_share = 0;
  for (const Scan& scan : test::room_tour(test::rng(), 8)) {
    const auto start = std::chrono::steady_clock::now();
    const ScanReport report = mapper.insert(scan);
    const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - start;
    EXPECT_LE(report.total_ms, elapsed.count());
    // All but those of which `detect` does the work, see find_surfaces_by().
    for (std::size_t stage = 0; stage < report.stage_ms.size(); ++stage)
      if (stage != static_cast<std::size_t>(Stage::add_inliers) &&
          stage != static_cast<std::size_t>(Stage::expand)) {
        EXPECT_GT(report.stage_ms[stage], 0) << "stage " << stage;
      }
    EXPECT_NEAR(std::accumulate(report.stage_ms.begin(), report.stage_ms.end(), 0.0), report.total_ms,
                1e-6 + 1e-9 * report.total_ms);
    largest_share = std::max(largest_share, report.total_ms / elapsed.count());
  }
  // Of one call at least, whatever else the machine does meanwhile: milliseconds, of the whole insert.
  EXPECT_GT(largest_share, 0.5);
}

TEST(MapperContract, PointsAndVoxelsAgree) {
  Mapper mapper;
  insert_all(mapper, test::room_tour(test::rng(), 4));
  const Map& map = mapper.map();
  std::size_t points = 0, pending = 0;
  map.for_each_point([&](const Map::Voxel& v) {
    ++points;
    pending += v.surface == 0;
    ASSERT_TRUE(v.point && v.view);
    EXPECT_EQ(v.occupancy, Map::Occupancy::occupied);
    EXPECT_NEAR(v.view->norm(), 1, 1e-5);
    const Map::Voxel same = map.at(*v.point);
    ASSERT_TRUE(same.point);
    EXPECT_EQ(*same.point, *v.point);
    EXPECT_EQ(same.surface, v.surface);
    EXPECT_GE(same.log_odds, 0);
  });
  EXPECT_EQ(points, map.size().points);
  EXPECT_EQ(pending, map.size().pending);
}

TEST(MapperContract, RefusesNonsense) {
  EXPECT_THROW(Mapper(Parameters{}, 0), Error);
  EXPECT_THROW(Mapper(Parameters{}, -3), Error);
  Parameters bad;
  bad.occupancy.resolution = -1;
  EXPECT_THROW(Mapper{bad}, Error);
}

TEST(MapperContract, AnEmptyMapIsAMap) {
  const Mapper mapper;
  EXPECT_EQ(mapper.map().size().nodes, 0U);
  EXPECT_EQ(mapper.snapshot()->surfaces.size(), 0U);
  EXPECT_EQ(mapper.snapshot()->find(1), nullptr);
  EXPECT_THAT(check_invariants(mapper.map()), ::testing::IsEmpty());
  EXPECT_EQ(mapper.map().at({0, 0, 0}).occupancy, Map::Occupancy::unknown);
}

}  // namespace
}  // namespace octosurf::mapper
