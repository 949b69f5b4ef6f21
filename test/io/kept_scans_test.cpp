// Scans that are kept for a map: what comes back, and which of them are the map's.
#include "io/kept_scans.hpp"

#include "io/map_file/map_files.hpp"
#include "io/readers/scan_list.hpp"
#include "support/room_tour.hpp"

#include <octosurf/scan_source.hpp>

namespace octosurf::test {
namespace {

class KeptScansTest : public MapFiles {
 protected:
  /// In folder/scans, the first of them as number `from`.
  void keep(const std::vector<Scan>& scans, std::uint64_t from = 0) const {
    io::ScanWriter writer(folder / "scans", from);
    for (const Scan& scan : scans) writer.add(scan);
    writer.finish();
  }
};

/// As its file alone has it.
Scan scan_in(const fs::path& file) {
  const io::ScanList list = io::list_scans({file}, {});
  const io::ListedScan& listed = list.recordings.front().scans.front();
  Scan scan = io::read_posed(list.recordings.front(), listed, {}).scan;
  scan.stamp_s = *listed.stamp_s;
  return scan;
}

void expect_same(const Scan& given, const Scan& read) {
  EXPECT_EQ(read.sensor, given.sensor);
  EXPECT_EQ(read.stamp_s, given.stamp_s);
  EXPECT_LT((read.T_map_sensor.matrix() - given.T_map_sensor.matrix()).norm(), 1e-14);
  ASSERT_EQ(read.points.size(), given.points.size());
  EXPECT_EQ(std::memcmp(read.points.data(), given.points.data(), 12 * given.points.size()), 0);
}

TEST_F(KeptScansTest, AScanComesBackToTheBit) {
  std::vector<Scan> given = room_tour(rng(), 3);
  given[0].points[5].setConstant(std::numeric_limits<float>::quiet_NaN());
  given[1].sensor = SensorKind::lidar;
  given[1].stamp_s = 1305031102.160407;
  given[2].stamp_s = -7;
  keep(given);
  const std::vector<fs::path> files = io::kept_scans(folder / "scans", 3);
  EXPECT_EQ(files[1].filename(), "000001_1305031102.160407.pcd");
  const auto others = open_scans(files);  // as any other clouds
  for (std::size_t i = 0; i < given.size(); ++i) {
    expect_same(given[i], scan_in(files[i]));
    Scan read = others->next().value();
    read.stamp_s = given[i].stamp_s;  // goes back in time here
    expect_same(given[i], read);
  }
}

TEST_F(KeptScansTest, OneWithoutReadingsIsKeptToo) {
  for (const SensorKind sensor : {SensorKind::depth_camera, SensorKind::lidar}) {
    Scan empty;
    empty.sensor = sensor;
    keep({empty});
    const Scan read = scan_in(io::kept_scans(folder / "scans", 1).front());
    EXPECT_EQ(read.sensor, sensor);
    for (const Eigen::Vector3f& point : read.points) EXPECT_FALSE(point.allFinite());
  }
}

TEST_F(KeptScansTest, AreReadWithTheirOwnPosesAndWithOthers) {
  std::vector<Scan> given = room_tour(rng(), 3);
  for (std::size_t i = 0; i < 3; ++i) given[i].stamp_s = 100 + 0.1 * static_cast<double>(i);
  keep(given);
  EXPECT_FALSE(is_occupancy_map(folder / "scans"));
  const auto own = open_scans({folder / "scans"});
  for (const Scan& scan : given) expect_same(scan, own->next().value());
  write_file(folder / "tum.txt", "100 1 0 0 0 0 0 1\n100.1 2 0 0 0 0 0 1\n100.2 3 0 0 0 0 0 1\n");
  write_file(folder / "plain.txt", "1 0 0 0 0 0 1\n2 0 0 0 0 0 1\n3 0 0 0 0 0 1\n");
  for (const char* file : {"tum.txt", "plain.txt"}) {
    ScanSourceOptions options;
    options.poses = folder / file;
    const auto moved = open_scans({folder / "scans"}, options);
    for (const double x : {1, 2, 3})
      EXPECT_NEAR(moved->next()->T_map_sensor.translation().x(), x, 1e-9) << file;
  }
}

TEST_F(KeptScansTest, GoingOnSetsAsideWhatWasLeftBehind) {
  const std::vector<Scan> scans = room_tour(rng(), 5);
  keep({scans.begin(), scans.begin() + 3});
  write_file(folder / "scans/000003_1.5.pcd", "left by a run that was killed");
  write_file(folder / "scans/000004_1.6.pcd", "likewise");
  write_file(folder / "scans/000004_1.7.pcd.part", "unfinished");
  EXPECT_EQ(open_scans({folder / "scans"})->size(), 5U);
  keep({scans.begin() + 3, scans.begin() + 4}, 3);
  const std::vector<fs::path> files = io::kept_scans(folder / "scans", 4);
  expect_same(scans[3], scan_in(files[3]));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "scans"), {}), 6);
  EXPECT_EQ(read_file(folder / "scans/aside/000003_1.5.pcd"), "left by a run that was killed");
  EXPECT_EQ(read_file(folder / "scans/aside/000004_1.6.pcd"), "likewise");
  keep({scans.begin() + 3, scans.end()}, 3);  // of which one is there
  expect_same(scans[4], scan_in(io::kept_scans(folder / "scans", 5)[4]));
  EXPECT_FALSE(fs::exists(folder / "scans/aside-2"));
  EXPECT_THAT(failure(Error::Kind::data, [&] { io::kept_scans(folder / "scans", 6); }), HasSubstr("5 of"));
  EXPECT_THAT(failure(Error::Kind::data, [&] { io::ScanWriter(folder / "scans", 6); }), HasSubstr("5 of"));
}

TEST_F(KeptScansTest, NeedAFolderOfTheirOwn) {
  EXPECT_NO_THROW(io::require_room_for_scans(folder / "none"));
  fs::create_directory(folder / "some");
  EXPECT_NO_THROW(io::require_room_for_scans(folder / "some"));
  write_file(folder / "some/000000_0.0.pcd", "");
  for (const char* const name : {"some", "some/000000_0.0.pcd"})
    EXPECT_THAT(failure(Error::Kind::usage, [&] { io::require_room_for_scans(folder / name); }),
                HasSubstr("not an empty folder"));
}

/// What a map file says of its scans, and that one without says nothing.
TEST_F(KeptScansTest, AMapRemembersWhereItsScansAre) {
  const Map map = map_of(changing_room(3));
  fs::create_directories(folder / "maps");
  save_map(map, folder / "maps/plain");
  EXPECT_TRUE(load_map(folder / "maps/plain").scans.folder.empty());

  KeptScans kept{folder / "scans", true, {}};
  kept.poses.assign(3, Eigen::Isometry3d::Identity());
  kept.poses[1].translation().x() = 0.1;
  save_map(map, folder / "maps/a", kept);
  const LoadedMap loaded = load_map(folder / "maps/a");
  EXPECT_EQ(fs::weakly_canonical(loaded.scans.folder), fs::weakly_canonical(folder / "scans"));
  EXPECT_TRUE(loaded.scans.shared);
  ASSERT_EQ(loaded.scans.poses.size(), 3U);
  EXPECT_EQ(loaded.scans.poses[1].matrix(), kept.poses[1].matrix());
  EXPECT_EQ(difference(map, loaded.map), "");
  fs::create_directory(folder / "elsewhere");
  fs::rename(folder / "maps", folder / "elsewhere/maps");
  EXPECT_EQ(fs::weakly_canonical(load_map(folder / "elsewhere/maps/a").scans.folder),
            fs::weakly_canonical(folder / "elsewhere/scans"))
      << "map and scans moved together";

  for (const std::size_t poses : {2, 4}) {
    kept.poses.resize(poses, Eigen::Isometry3d::Identity());
    save_map(map, folder / "c", kept);
    EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "c"); }), HasSubstr("poses of"));
  }
  kept.poses.assign(3, Eigen::Isometry3d(Eigen::Scaling(2.0)));
  save_map(map, folder / "c", kept);
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "c"); }), HasSubstr("rigid"));
}

}  // namespace
}  // namespace octosurf::test
