// What every map keeps, whatever it is of: each promise once, over worlds of every kind.
#include "contract/worlds.hpp"
#include "io/map_file/map_file.hpp"
#include "io/map_file/map_files.hpp"
#include "support/checked_mapper.hpp"
#include "support/guarantees.hpp"
#include "support/room_tour.hpp"

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Contract : public MapFiles, public ::testing::WithParamInterface<World> {
 protected:
  const World& world = GetParam();
  const Mapped& run = run_of(world);
};

INSTANTIATE_TEST_SUITE_P(Worlds, Contract, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return std::string(each.param.name); });

TEST_P(Contract, InvariantsHoldAfterEveryScan) {
  for (std::size_t i = 0; i < run.wrong.size(); ++i) EXPECT_THAT(run.wrong[i], IsEmpty()) << "scan " << i;
  for (std::size_t i = 0; i < world.shows.size(); ++i)
    EXPECT_GT(run.seen.*world.shows[i], 0U) << "it shows nothing of its point " << i;
  expect_guarantees(run.map);
  std::size_t points = 0;
  run.map.for_each_point([&](const OccupancyView::Voxel& voxel) {
    ++points;
    const OccupancyView::Voxel same = run.map.at(voxel.point);
    EXPECT_EQ(same.point, voxel.point);
    EXPECT_EQ(same.view, voxel.view);
    EXPECT_EQ(same.log_odds, voxel.log_odds);
    EXPECT_EQ(same.surface, voxel.surface);
    EXPECT_EQ(same.state, OccupancyView::State::occupied);
    EXPECT_NEAR(voxel.view.norm(), 1, 1e-5);
  });
  EXPECT_EQ(points, run.map.size().points);
}

/// Half of the way by one mapper, the rest by another that takes its map over.
TEST_P(Contract, NeitherThreadsNorAMapperAnewChangeAByteAndSnapshotsTellWhatChanged) {
  std::optional<Mapper> mapper(std::in_place, world.parameters, 3, paper_detector());
  std::set<SurfaceId> gone;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    if (i == run.scans.size() / 2) mapper.emplace(Map(std::move(*mapper).release()), 2, paper_detector());
    const auto before = mapper->snapshot();
    mapper->insert(run.scans[i]);
    const auto after = mapper->snapshot();
    std::vector<SurfacePtr> changed;
    for (const SurfacePtr& surface : after->surfaces) {
      if (before->find(surface->id) != surface.get()) changed.push_back(surface);
      EXPECT_FALSE(gone.contains(surface->id)) << "an id came back";
    }
    EXPECT_EQ(after->changed_since(before->revision), changed);
    EXPECT_EQ(after->changed_since(0), after->surfaces);
    for (const SurfacePtr& surface : before->surfaces)
      if (after->find(surface->id) == nullptr) gone.insert(surface->id);
    if (i % 4 == 3) {
      ASSERT_TRUE(bytes_of(mapper->map()) == run.bytes[i]) << "after scan " << i;
    }
  }
  EXPECT_TRUE(bytes_of(mapper->map()) == run.bytes.back());
  EXPECT_EQ(difference(run.map, mapper->map()), "");
  EXPECT_TRUE(digest(run.map) == digest(mapper->map()));
}

TEST_P(Contract, StopsAfterEveryScanChangeNothing) {
  std::optional<Mapper> resumed(std::in_place, world.parameters, 1, paper_detector());
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const ScanReport report = resumed->insert(run.scans[i]);
    ASSERT_TRUE(bytes_of(resumed->map()) == run.bytes[i]) << "after scan " << i;
    ASSERT_EQ(report.grown, run.grown[i]);
    save_map(resumed->map(), folder / "map");
    LoadedMap loaded = load_map(folder / "map");
    ASSERT_EQ(loaded.warning, "");
    ASSERT_EQ(difference(resumed->map(), loaded.map), "") << "after scan " << i;
    ASSERT_THAT(check_invariants(loaded.map), IsEmpty());
    resumed.emplace(std::move(loaded.map), 1, paper_detector());
  }
  EXPECT_EQ(difference(run.map, resumed->map()), "");
  save_map(resumed->map(), folder / "again");
  save_map(run.map, folder / "unstopped");
  for (const char* other : {"again", "unstopped"}) {
    EXPECT_EQ(digest_of(load_map(folder / "map").map), digest_of(load_map(folder / other).map));
    EXPECT_TRUE(read_file(folder / "map.bt") == read_file(folder / (other + std::string(".bt"))));
  }
}

/// Voxels hold 24 bits of an id. After 2²⁴ surfaces these come again, and nothing but the ids differs.
TEST_P(Contract, IdsOutlastTheNumbersInVoxels) {
  std::optional<Mapper> mapper(std::in_place, world.parameters, 1, paper_detector());
  constexpr SurfaceId late = 3 * occupancy::SurfaceNumbers::count;
  SurfaceId first_late = 0;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    if (i == run.scans.size() / 3) {
      Map map = std::move(*mapper).release();
      first_late = surfaces::state_of(map).surfaces.next_id();
      surfaces::state_of(map).surfaces.set_next_id(late);
      mapper.emplace(std::move(map), 2, paper_detector());
    } else if (i % 4 == 3) {
      save_map(mapper->map(), folder / "map");
      LoadedMap loaded = load_map(folder / "map");
      ASSERT_EQ(difference(mapper->map(), loaded.map), "") << "before scan " << i;
      mapper.emplace(std::move(loaded.map), 1, paper_detector());
    }
    mapper->insert(run.scans[i]);
  }
  EXPECT_THAT(check_invariants(mapper->map()), IsEmpty());
  const auto now = mapper->snapshot(), plain = run.map.snapshot();
  ASSERT_EQ(now->surfaces.size(), plain->surfaces.size());
  for (std::size_t i = 0; i < plain->surfaces.size(); ++i) {
    const Surface &here = *now->surfaces[i], &there = *plain->surfaces[i];
    EXPECT_TRUE(there.id < first_late ? here.id == there.id : here.id >= late) << here.id;
    EXPECT_EQ(here.inliers, there.inliers);
    EXPECT_EQ(here.plane.normal, there.plane.normal);
    EXPECT_EQ(here.plane.offset, there.plane.offset);
    EXPECT_EQ(here.area_m2, there.area_m2);
  }
}

/// The map of the scans in groups of one to three; `prepare` returns the group of some scans.
template <class Prepare>
std::string grouped(const World& world, std::span<const Scan> scans, int threads, const Prepare& prepare) {
  std::mt19937_64 groups = rng();
  Mapper mapper(world.parameters, threads, paper_detector());
  while (!scans.empty()) {
    const std::size_t count = std::min<std::size_t>(1 + groups() % 3, scans.size());
    scans = scans.subspan(mapper.insert_all(prepare(mapper, scans.first(count))).size());
    EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  }
  return bytes_of(mapper.map());
}

TEST_P(Contract, PreparationOfScansThatComeTogetherChangesNothing) {
  const std::string plain =
      grouped(world, run.scans, 1, [](const Mapper&, std::span<const Scan> scans) { return scans; });
  const auto prepared = [](const Mapper& mapper, std::span<const Scan> scans) {
    std::vector<PreparedScan> group;
    for (const Scan& scan : scans)  // every second one
      group.push_back(group.size() % 2 == 0 ? mapper.prepare(scan) : PreparedScan(scan));
    return group;
  };
  EXPECT_TRUE(grouped(world, run.scans, 2, prepared) == plain);
}

TEST_P(Contract, RefusedScansLeaveTheMapAsItWas) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const double edge = world.parameters.occupancy.resolution * 32768;
  const std::size_t half = run.scans.size() / 2;
  Mapper mapper(world.parameters, 1, paper_detector());
  for (std::size_t i = 0; i < half; ++i) mapper.insert(run.scans[i]);
  const auto snapshot = mapper.snapshot();
  const auto refuse = [&](const std::function<void(Scan&)>& spoil) {
    Scan scan = run.scans[half];
    scan.name = "bad one";
    spoil(scan);
    EXPECT_THAT(failure(Error::Kind::data, [&] { mapper.insert(scan); }), HasSubstr("bad one"));
    EXPECT_TRUE(bytes_of(mapper.map()) == run.bytes[half - 1]);
    EXPECT_EQ(mapper.snapshot(), snapshot);
  };
  refuse([&](Scan& s) { s.T_map_sensor.linear()(0, 0) = nan; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().y() = nan; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().y() = std::numeric_limits<double>::infinity(); });
  refuse([&](Scan& s) { s.T_map_sensor.linear() *= 1.01; });
  refuse([&](Scan& s) { s.T_map_sensor.linear().col(0) *= -1; });
  refuse([&](Scan& s) { s.T_map_sensor.linear().setZero(); });
  refuse([&](Scan& s) { s.T_map_sensor.translation().x() = edge + 1; });
  refuse([&](Scan& s) { s.T_map_sensor.translation().z() = -1e9; });
  for (std::size_t i = half; i < run.scans.size(); ++i) mapper.insert(run.scans[i]);
  EXPECT_TRUE(bytes_of(mapper.map()) == run.bytes.back()) << "it goes on as if nothing had been";
}

/// As many ids are left as a map file may say: none for what is new, and what needs none goes on.
TEST(MapperContract, AScanThatUsesUpTheIdsIsRefusedUntouchedAndNoOther) {
  const std::vector<Scan> scans = room_tour(rng(), 4);
  Mapper before;
  before.insert(scans[0]);
  Map map = std::move(before).release();
  surfaces::state_of(map).surfaces.set_next_id(last_id + 1);
  Mapper mapper(std::move(map));
  const std::string stood = digest(mapper.map());
  const auto snapshot = mapper.snapshot();
  EXPECT_THAT(failure(Error::Kind::data, [&] { mapper.insert(scans[3]); }), HasSubstr("ids"));
  EXPECT_TRUE(digest(mapper.map()) == stood);
  EXPECT_EQ(mapper.snapshot(), snapshot);
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  for (const Scan& scan : {scans[0], Scan()}) mapper.insert(scan);
  EXPECT_EQ(mapper.map().size().scans, 3U);
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
}

TEST(MapperContract, WhatIsRefusedLeavesTheCallerItsMap) {
  Mapper before;
  for (const Scan& scan : room_tour(rng(), 2)) before.insert(scan);
  Map map = std::move(before).release();
  const std::string stood = digest(map);
  for (const int threads : {0, -1, 257}) EXPECT_THROW(Mapper(std::move(map), threads), Error) << threads;
  Parameters bad;
  bad.occupancy.resolution = -1;
  EXPECT_THROW(Mapper{bad}, Error);
  EXPECT_TRUE(digest(map) == stood);
  EXPECT_TRUE(digest(Mapper(std::move(map), 2).map()) == stood);
}

TEST(MapperContract, ScansThatSayNothingChangeNothing) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  CheckedMapper under_test;
  Scan empty;
  ScanReport report = under_test.insert(empty);
  EXPECT_EQ(report.points_raw, 0U);
  EXPECT_EQ(report.voxels, 0U);
  EXPECT_TRUE(under_test.surfaces().empty());
  for (const Scan& scan : room_tour(rng(), 3)) under_test.insert(scan);
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
  using O = OccupancyView::State;
  EXPECT_EQ(under_test.mapper.map().at({0, 2.9, 0}).state, O::free)
      << "points beyond free what is before them";
  EXPECT_EQ(under_test.mapper.map().at({0, 5, 0}).state, O::unknown);
  EXPECT_EQ(under_test.mapper.map().at({0, -2, 0}).state, O::occupied);
  EXPECT_EQ(under_test.mapper.map().at({1e9, 0, 0}).state, O::unknown);
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

TEST(MapperContract, ReportsItsTime) {
  Mapper mapper;
  double largest_share = 0;
  for (const Scan& scan : room_tour(rng(), 8)) {
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

TEST(MapperContract, AnEmptyMapIsAMap) {
  const Mapper mapper({}, 2);  // braces are the usual parameters
  EXPECT_EQ(mapper.map().parameters().occupancy.resolution, Parameters().occupancy.resolution);
  EXPECT_EQ(mapper.map().size().nodes, 0U);
  EXPECT_EQ(mapper.snapshot()->surfaces.size(), 0U);
  EXPECT_EQ(mapper.snapshot()->find(1), nullptr);
  EXPECT_THAT(check_invariants(mapper.map()), IsEmpty());
  EXPECT_EQ(mapper.map().at({0, 0, 0}).state, OccupancyView::State::unknown);
}

}  // namespace
}  // namespace octosurf::test
