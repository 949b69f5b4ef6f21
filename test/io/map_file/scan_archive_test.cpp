// Archives of scans: what comes back, what a map built from one is, and what damage does.
#include "io/map_file/scan_archive.hpp"

#include "io/map_file/record_stream.hpp"
#include "map_files.hpp"
#include "support/random_scans.hpp"
#include "support/scene.hpp"
#include "surfaces/map_state.hpp"

#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <random>
#include <sstream>

#include <octosurf/scan_source.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Depth images of a table in a corner of a room, from changing sides; the last things lie beyond the range.
std::vector<Scan> room(std::size_t scans) {
  Scene scene;
  scene.rectangle({-2, -2, 0}, {9, 0, 0}, {0, 9, 0}).rectangle({-2, -2, 0}, {9, 0, 0}, {0, 0, 3});
  scene.rectangle({-2, -2, 0}, {0, 9, 0}, {0, 0, 3}).box({0, 0, 0}, {0.8, 0.8, 0.7});
  std::mt19937_64 random = rng();
  Camera small;
  small.width = 120;
  small.height = 90;
  small.focal = 100;
  std::vector<Scan> all;
  for (std::size_t i = 0; i < scans; ++i) {
    const double a = 0.4 * static_cast<double>(i);
    const Eigen::Vector3d eye(0.4 + 1.8 * std::cos(a), 0.4 + 1.8 * std::sin(a), 1.4);
    all.push_back(camera_scan(scene, look_at(eye, {0.4, 0.4, 0.5}), random, small));
    all.back().stamp_s = 100 + 0.1 * static_cast<double>(i);
    all.back().name = "image " + std::to_string(i);
  }
  return all;
}

class ScanArchives : public MapFiles {
 protected:
  /// Maps the scans with `mapper` and keeps them in folder/scans, as `octosurf map --keep-scans` does.
  void keep(const std::vector<Scan>& scans, Mapper& mapper) const {
    mapper.round_scans();
    io::ScanArchiveWriter archive(folder / "scans", mapper.map().size().scans);
    sensing::NoiseModel::Histogram noise = mapper.map().state().noise.histogram();
    for (const Scan& scan : scans) {
      const ScanReport report = mapper.insert(scan);
      const surfaces::MapState& state = mapper.map().state();
      archive.add(
          {scan.name, scan.stamp_s, scan.sensor, state.parameters.occupancy.resolution, scan.T_map_sensor,
           report.alignment.T_map_sensor, state.noise.seen_since(noise), mapper.last_shared_variances()},
          mapper.last_voxels());
      noise = state.noise.histogram();
    }
    archive.finish();
  }
  static io::ArchivedScan through_a_file(const io::ArchivedScan& scan, const fs::path& file) {
    write_file(file, bytes_of(scan));
    return io::read_archived_scan(file);
  }
  static std::string bytes_of(const io::ArchivedScan& scan) {
    std::ostringstream out;
    io::write_archived_scan(scan, out);
    return out.str();
  }
  /// What reading these bytes comes to; any other exception fails the test.
  std::string reading(const std::string& bytes) const {
    write_file(folder / "x.scan", bytes);
    try {
      io::read_archived_scan(folder / "x.scan");
      return "read";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), Error::Kind::data);
      EXPECT_THAT(error.what(), HasSubstr("x.scan"));
      return error.what();
    }
  }
};

/// The obvious twin: the voxels of the scan as they were mapped, uncompressed.
TEST_F(ScanArchives, AScanComesBackAsItWasMapped) {
  for (const double resolution : {0.02, 0.07}) {
    Parameters parameters;
    parameters.occupancy.resolution = resolution;
    Mapper mapper(parameters);
    mapper.round_scans();
    Scan given = room(1).front();
    given.sensor = SensorKind::lidar;  // sees on beyond 4 m
    mapper.insert(given);
    const sensing::VoxelScan& twin = mapper.last_voxels();
    Eigen::Isometry3d other = given.T_map_sensor;
    other.translation().x() += 0.25;
    const io::ArchivedHeader header{"a name",
                                    12.5,
                                    given.sensor,
                                    resolution,
                                    other,
                                    given.T_map_sensor,
                                    {{3, 1, 7}, {3, 150, 1}, {15, 159, 1000000}},
                                    {{0, 1e-6}, {3, -2e-7}}};
    const io::ArchivedScan read = through_a_file(io::archived(header, twin), folder / "a.scan");
    EXPECT_EQ(read.header.name, header.name);
    EXPECT_EQ(read.header.stamp_s, header.stamp_s);
    EXPECT_EQ(read.header.sensor, SensorKind::lidar);
    EXPECT_EQ(read.header.resolution, resolution);
    EXPECT_EQ(read.header.T_given.matrix(), other.matrix());
    EXPECT_EQ(read.header.T_used.matrix(), given.T_map_sensor.matrix());
    ASSERT_EQ(read.header.noise.size(), 3U);
    EXPECT_EQ(read.header.noise[2].range_class, 15);
    EXPECT_EQ(read.header.noise[2].size, 159);
    EXPECT_EQ(read.header.noise[2].count, 1000000U);
    ASSERT_EQ(read.header.shared_variances.size(), 2U);
    EXPECT_EQ(read.header.shared_variances[1].range_class, 3);
    EXPECT_EQ(read.header.shared_variances[1].variance, -2e-7);
    const Scan scan = read.scan();
    ASSERT_GT(twin.ends.size(), 1000U);
    ASSERT_EQ(scan.points.size(), twin.ends.size());
    for (std::size_t i = 0; i < twin.ends.size(); ++i) {
      EXPECT_EQ(read.points[i].key, twin.ends[i].key);
      EXPECT_EQ(scan.readings[i], twin.ends[i].count);
      const Eigen::Vector3d in_map = scan.T_map_sensor * scan.points[i].cast<double>();
      EXPECT_LT((in_map - twin.ends[i].centroid.cast<double>()).norm(), 2e-6);  // float, within 10 m
    }
  }
}

TEST_F(ScanArchives, AnEmptyScanIsKeptToo) {
  const io::ArchivedScan empty{{"", 0, SensorKind::lidar, 0.02}, {}};
  EXPECT_TRUE(through_a_file(empty, folder / "a.scan").points.empty());
}

/// Rounding before mapping is what makes that so; nothing may differ.
TEST_F(ScanArchives, AMapFromTheArchiveIsTheMapToTheBit) {
  Parameters parameters;
  parameters.occupancy.min_range = 0.4;
  parameters.alignment.enabled = false;  // what is known of the poses is not archived
  std::vector<Scan> given = room(8);
  for (Eigen::Vector3f& p : given[3].points) p *= 0.05F;  // all too near, but they tell the noise
  Mapper first(parameters);
  keep(given, first);
  ASSERT_GT(first.snapshot()->surfaces.size(), 3U);
  ASSERT_TRUE(io::read_archived_scan(folder / "scans/000003.scan").points.empty());
  Mapper second(parameters, 2);
  const auto scans = open_scans({folder / "scans"});
  EXPECT_EQ(scans->size(), 8U);
  while (const std::optional<Scan> scan = scans->next()) second.insert(*scan);
  EXPECT_EQ(difference(first.map(), second.map()), "");
}

/// Beside the map of the scans as they are. What rounding moves is bounded by rounded_scan.hpp: voxels are
/// the same, points move by half a step of at most spread·√(0.12·(8 + n)/(8n)) ≤ 0.37 spread, so a plane of
/// hundreds of readings by a hundredth of its own uncertainty. Which points a plane takes may differ at its
/// rim, by points within that of its tolerance.
TEST_F(ScanArchives, RoundingMovesPlanesFarLessThanTheirNoise) {
  const std::vector<Scan> scans = room(8);
  Mapper rounded, plain;
  keep(scans, rounded);
  for (const Scan& scan : scans) plain.insert(scan);
  std::size_t found = 0;
  for (const SurfacePtr& surface : plain.snapshot()->surfaces) {
    if (surface->area_m2 < 0.3) continue;
    for (const SurfacePtr& other : rounded.snapshot()->surfaces) {
      const Eigen::Vector3d there = surface->T_map_surface.translation();
      if (other->plane.normal.dot(surface->plane.normal) < 0.99 ||
          std::fabs(other->plane.signed_distance(there)) > 0.01 || other->area_m2 < 0.3)
        continue;
      ++found;
      EXPECT_LT(std::fabs(other->plane.signed_distance(there)), 0.001) << surface->id;
      EXPECT_NEAR(other->area_m2, surface->area_m2, 0.05 * surface->area_m2 + 0.02) << surface->id;
    }
  }
  EXPECT_GE(found, 4U);  // floor, walls, table
}

TEST_F(ScanArchives, RoundingIsWithinItsBoundAndHasNoBias) {
  const std::vector<Scan> scans = room(6);
  Mapper rounded, plain;
  rounded.round_scans();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (const Scan& scan : scans) {
    const sensing::NoiseModel noise = rounded.map().state().noise;
    rounded.insert(scan);
    plain.insert(scan);
    std::map<std::uint64_t, sensing::EndVoxel> twin;
    for (const sensing::EndVoxel& end : plain.last_voxels().ends) twin[end.key.packed()] = end;
    ASSERT_EQ(twin.size(), rounded.last_voxels().ends.size());
    for (const sensing::EndVoxel& end : rounded.last_voxels().ends) {
      const sensing::EndVoxel& was = twin.at(end.key.packed());
      const sensing::VoxelScan& all = rounded.last_voxels();
      if (!all.within_range(geometry::VoxelGrid(0.02).centre_of(end.key))) continue;
      const Eigen::Vector3d shift = (end.centroid - was.centroid).cast<double>();
      const double spread = noise.measured_sigma(sensing::range_class_of((was.centroid - all.origin).norm()));
      const double n = 8.0 * was.count / (8 + was.count);
      const double step = std::max(0.02 / 256, spread * std::sqrt(0.12 / n));
      EXPECT_LE(shift.cwiseAbs().maxCoeff(), step / 2 + 0.02 / 512 + 2e-6);
      EXPECT_NEAR(end.count, was.count, was.count / 8.0);
      sum += shift;
      ++count;
    }
  }
  // Steps of 1.6 mm at most here, q²/12 each: 0.5 mm over √count, and the half 256th that a scan may lean to.
  EXPECT_LT((sum / count).cwiseAbs().maxCoeff(), 5 * 0.0005 / std::sqrt(count) + 0.02 / 512);
}

TEST_F(ScanArchives, AreReadWithOtherPoses) {
  Mapper mapper;
  const std::vector<Scan> given = room(3);
  keep(given, mapper);
  EXPECT_EQ(classify(folder / "scans"), InputKind::scans);
  EXPECT_EQ(classify(folder / "scans/000001.scan"), InputKind::scans);
  const auto own = open_scans({folder / "scans"});
  for (const Scan& scan : given) {
    const Scan read = own->next().value();
    EXPECT_EQ(read.T_map_sensor.matrix(), scan.T_map_sensor.matrix());
    EXPECT_EQ(read.stamp_s, scan.stamp_s);
  }
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

TEST_F(ScanArchives, GoingOnReplacesWhatWasLeftBehind) {
  const std::vector<Scan> scans = room(5);
  Mapper mapper;
  keep({scans.begin(), scans.begin() + 3}, mapper);
  write_file(folder / "scans/000003.scan", "left by a run that was killed");
  write_file(folder / "scans/000004.scan", "likewise");
  keep({scans.begin() + 3, scans.begin() + 4}, mapper);
  EXPECT_EQ(io::archived_files(folder / "scans", 4).size(), 4U);
  EXPECT_FALSE(fs::exists(folder / "scans/000004.scan"));
  EXPECT_EQ(io::read_archived_header(folder / "scans/000003.scan").name, "image 3");
  EXPECT_THAT(failure(Error::Kind::data, [&] { io::archived_files(folder / "scans", 5); }),
              HasSubstr("000004.scan"));
  io::copy_archive(folder / "scans", folder / "copy", 2);
  EXPECT_EQ(read_file(folder / "copy/000001.scan"), read_file(folder / "scans/000001.scan"));
  EXPECT_FALSE(fs::exists(folder / "copy/000002.scan"));
}

TEST_F(ScanArchives, NeedAFolderOfTheirOwn) {
  EXPECT_NO_THROW(io::require_room_for_archive(folder / "none", false));
  fs::create_directory(folder / "some");
  EXPECT_NO_THROW(io::require_room_for_archive(folder / "some", false));
  write_file(folder / "some/000000.scan", "");
  EXPECT_THAT(failure(Error::Kind::usage, [&] { io::require_room_for_archive(folder / "some", false); }),
              HasSubstr("--force"));
  EXPECT_NO_THROW(io::require_room_for_archive(folder / "some", true));
  write_file(folder / "some/letter.txt", "");
  EXPECT_THAT(failure(Error::Kind::usage, [&] { io::require_room_for_archive(folder / "some", true); }),
              HasSubstr("other things"));
  EXPECT_THAT(
      failure(Error::Kind::output, [&] { io::require_room_for_archive(folder / "some/letter.txt", true); }),
      HasSubstr("not a folder"));
}

TEST_F(ScanArchives, DamagedFilesAreRefused) {
  Mapper mapper;
  keep(room(1), mapper);
  const std::string good = read_file(folder / "scans/000000.scan");
  const io::ArchivedScan whole = io::read_archived_scan(folder / "scans/000000.scan");
  EXPECT_EQ(bytes_of(whole), good);
  expect_refused_when_damaged(
      good, "is not an archived scan", [&](const std::string& bytes) { return reading(bytes); },
      [&] { return bytes_of(io::read_archived_scan(folder / "x.scan")); });
}

/// Each is written by write_archived_scan, so that its checksum is right.
TEST_F(ScanArchives, NonsenseIsRefused) {
  Mapper mapper;
  keep(room(1), mapper);
  const io::ArchivedScan good = io::read_archived_scan(folder / "scans/000000.scan");
  const auto with = [&](const std::function<void(io::ArchivedScan&)>& change) {
    io::ArchivedScan scan = good;
    change(scan);
    return reading(bytes_of(scan));
  };
  EXPECT_EQ(with([](io::ArchivedScan&) {}), "read");
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.points[5].readings = 0; }), HasSubstr("readings"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.points[5].key = s.points[4].key; }), HasSubstr("order"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { std::swap(s.points[5], s.points[6]); }), HasSubstr("order"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.header.resolution = 0; }), HasSubstr("header"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.header.stamp_s = std::nan(""); }), HasSubstr("header"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.header.T_used.linear() *= 2; }), HasSubstr("rigid"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.header.T_used.translation().x() = 1e6; }),
              HasSubstr("outside"));
  EXPECT_THAT(with([](io::ArchivedScan& s) { s.header.noise = {{2, 3, 1}, {2, 3, 1}}; }), HasSubstr("noise"));
}

/// Small files that would become large ones.
TEST_F(ScanArchives, WhatDecompressesToFarMoreThanItsSizeIsRefused) {
  std::ostringstream out;
  out.write("\x89OCTSC\r\n\x01\0\0\0", 12);
  io::RecordWriter records(out);
  records.put(std::string(std::size_t{3} << 20, '\1'));
  records.finish();
  ASSERT_LT(out.str().size(), 10000U);
  EXPECT_THAT(reading(out.str()), HasSubstr("far more than its size allows"));
}

/// What a map file says of its scans, and that one without says nothing.
TEST_F(ScanArchives, AMapRemembersWhereItsScansAre) {
  const Map map = map_of(changing_room(3));
  fs::create_directories(folder / "maps");
  save_map(map, folder / "maps/plain");
  EXPECT_TRUE(load_map(folder / "maps/plain").scans.folder.empty());

  KeptScans kept{folder / "scans", true, {}};
  save_map(map, folder / "maps/a", kept);
  EXPECT_EQ(read_file(folder / "maps/a.surfaces")[8], read_file(folder / "maps/plain.surfaces")[8])
      << "version: an older reader may leave it aside";
  EXPECT_EQ(fs::weakly_canonical(load_map(folder / "maps/a").scans.folder),
            fs::weakly_canonical(folder / "scans"));
  EXPECT_TRUE(load_map(folder / "maps/a").scans.shared);
  fs::create_directory(folder / "elsewhere");
  fs::rename(folder / "maps", folder / "elsewhere/maps");
  EXPECT_EQ(fs::weakly_canonical(load_map(folder / "elsewhere/maps/a").scans.folder),
            fs::weakly_canonical(folder / "elsewhere/scans"))
      << "map and scans moved together";

  kept.poses.assign(3, Eigen::Isometry3d::Identity());
  kept.poses[1].translation().x() = 0.1;
  save_map(map, folder / "b", kept);
  const LoadedMap loaded = load_map(folder / "b");
  ASSERT_EQ(loaded.scans.poses.size(), 3U);
  EXPECT_EQ(loaded.scans.poses[1].matrix(), kept.poses[1].matrix());
  EXPECT_EQ(difference(map, loaded.map), "");

  kept.poses.resize(4, Eigen::Isometry3d::Identity());
  save_map(map, folder / "c", kept);
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "c"); }), HasSubstr("poses of scans"));
  kept.poses.assign(1, Eigen::Isometry3d(Eigen::Scaling(2.0)));
  save_map(map, folder / "c", kept);
  EXPECT_THAT(failure(Error::Kind::data, [&] { load_map(folder / "c"); }), HasSubstr("rigid"));
}

}  // namespace
}  // namespace octosurf::test
