// Scans that are kept while mapping, and maps that are built anew from them.
#include "apps/command.hpp"
#include "apps/running.hpp"
#include "io/kept_scans.hpp"
#include "io/readers/pose_file.hpp"
#include "property/same_surfaces.hpp"
#include "support/invariants.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"

#include <chrono>
#include <cmath>
#include <gmock/gmock.h>
#include <random>
#include <thread>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Remap : public CommandTest {
 protected:
  std::vector<Eigen::Isometry3d> poses(const std::string& file) const {
    std::vector<Eigen::Isometry3d> all;
    for (const io::FilePose& pose : io::read_poses(folder / file).poses) all.push_back(pose.T);
    return all;
  }
  void write_poses(const std::string& file, const std::vector<Eigen::Isometry3d>& all) const {
    std::string lines;
    for (std::size_t i = 0; i < all.size(); ++i)
      lines += io::tum_line(static_cast<double>(i) / 30, all[i]) + "\n";
    write(file, lines);
  }
  std::size_t files_in(const std::string& scans) const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder / scans), {}));
  }
  /// Kept ones, so many; what a killed run has left behind is not looked at.
  void same_scans(const std::string& a, const std::string& b, std::size_t scans) const {
    const std::vector<fs::path> of_a = io::kept_scans(folder / a, scans),
                                of_b = io::kept_scans(folder / b, scans);
    for (std::size_t i = 0; i < scans; ++i) {
      EXPECT_EQ(of_a[i].filename(), of_b[i].filename());
      EXPECT_TRUE(read(a + "/" + of_a[i].filename().string()) == read(b + "/" + of_b[i].filename().string()))
          << of_a[i];
    }
  }
  std::shared_ptr<const Snapshot> surfaces(const std::string& map) const {
    const LoadedMap loaded = load_map(folder / map);
    EXPECT_THAT(check_invariants(loaded.map), IsEmpty());
    return loaded.map.snapshot();
  }

  /// Twelve depth images "room" of a table in a corner, from sides that change, 2 mm of noise; poses.txt.
  void write_room() const {
    made_once("corner" + std::to_string(seed()), [this] { make_room(); });
  }
  void make_room() const {
    constexpr int images = 12;
    Scene scene;
    scene.rectangle({-1, -1, 0}, {3, 0, 0}, {0, 3, 0}).rectangle({-1, -1, 0}, {3, 0, 0}, {0, 0, 2});
    scene.rectangle({-1, -1, 0}, {0, 3, 0}, {0, 0, 2}).box({0, 0, 0}, {0.9, 0.8, 0.7});
    Camera camera;
    camera.width = 160;
    camera.height = 120;
    camera.focal = 130;
    std::mt19937_64 random = rng();
    std::string lines;
    for (int i = 0; i < images; ++i) {
      const double a = 1.6 * i / images;
      const Eigen::Isometry3d T =
          look_at({0.4 + 1.9 * std::cos(a), 0.4 + 1.9 * std::sin(a), 1.5}, {0.2, 0.2, 0.5});
      std::string image = "P5\n160 120\n65535\n";
      for (const Eigen::Vector3f& p : camera_scan(scene, T, random, camera).points) {
        const int depth_mm = p.allFinite() ? static_cast<int>(std::lround(1000 * p.z())) : 0;
        image += {static_cast<char>(depth_mm >> 8), static_cast<char>(depth_mm & 0xff)};
      }
      write("room/" + std::to_string(i) + ".pgm", image);
      lines += io::tum_line(i / 30.0, T) + "\n";
    }
    write("room/poses.txt", lines);
    write("room/intrinsics.txt", "130 130 79.5 59.5\n");
  }

  /// Every large surface of `before` still has its id, where T has moved it. Returns how many there are.
  static std::size_t expect_ids(const Snapshot& before, const Snapshot& after, const Eigen::Isometry3d& T) {
    std::size_t large_ones = 0;
    for (const SurfacePtr& surface : before.surfaces) {
      if (surface->area_m2 < 0.3) continue;
      ++large_ones;
      const Surface* same = after.find(surface->id);
      EXPECT_NE(same, nullptr) << surface->id;
      if (same != nullptr) {
        EXPECT_GE(shared(*surface, T, *same).area, surface->area_m2 / 2) << surface->id;
      }
    }
    return large_ones;
  }
};

TEST_F(Remap, WithTheSamePosesGivesTheSameMap) {
  write_room();
  // Residuals are of the scans as they are given.
  run_well("map room -o m --resolution 0.04 --keep-scans kept --align off");
  EXPECT_EQ(files_in("kept"), 12U);
  EXPECT_THAT(run_well("remap m -o n --report r.json").out, HasSubstr("0 new; 0 of those before are gone"));
  EXPECT_TRUE(read("m.bt") == read("n.bt"));
  const json report = read_json("r.json");
  EXPECT_EQ(report.at("remap").at("kept"), report.at("surfaces"));
  EXPECT_EQ(report.at("remap").at("new"), 0);
  EXPECT_THAT(report.at("remap").at("gone"), IsEmpty());
  const auto before = surfaces("m"), after = surfaces("n");
  ASSERT_EQ(before->surfaces.size(), after->surfaces.size());
  ASSERT_GT(before->surfaces.size(), 3U);
  for (std::size_t i = 0; i < before->surfaces.size(); ++i) {
    EXPECT_EQ(before->surfaces[i]->id, after->surfaces[i]->id);
    EXPECT_EQ(before->surfaces[i]->plane.normal, after->surfaces[i]->plane.normal);
    EXPECT_EQ(before->surfaces[i]->plane.offset, after->surfaces[i]->plane.offset);
    EXPECT_EQ(before->surfaces[i]->parents, after->surfaces[i]->parents);
  }
  EXPECT_EQ(after->revision, before->revision + 1);
}

TEST_F(Remap, ARigidMotionMovesTheMapAndKeepsIds) {
  write_room();
  run_well("map room -o m --resolution 0.04 --keep-scans kept --write-poses p.txt");
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.1, 0.2, 1).normalized()));
  T.translation() << 0.513, -1.207, 0.331;
  std::vector<Eigen::Isometry3d> corrected = poses("p.txt");
  for (Eigen::Isometry3d& pose : corrected) pose = T * pose;
  write_poses("moved.txt", corrected);
  const auto before = surfaces("m");
  run_well("remap m --poses moved.txt --write-poses used.txt");  // in place
  const auto after = surfaces("m");
  EXPECT_GE(expect_ids(*before, *after, T), 4U);
  expect_same(before->surfaces, after->surfaces, T, other_points);
  const std::vector<Eigen::Isometry3d> used = poses("used.txt");
  for (std::size_t i = 0; i < used.size(); ++i)
    EXPECT_LT((used[i].matrix() - corrected[i].matrix()).norm(), 1e-12);

  // And back: the map knows its poses, the scans those of the beginning.
  run_well("remap m --poses p.txt");
  EXPECT_GE(expect_ids(*before, *surfaces("m"), Eigen::Isometry3d::Identity()), 4U);
  run_well("map room --resume m --skip 11");
  EXPECT_EQ(files_in("kept"), 13U);
  run_well("remap m");
}

TEST_F(Remap, ARecordingWhoseSecondHalfIsOffIsPutRight) {
  write_room();
  run_well("map room -o true --resolution 0.03 --keep-scans true.scans --write-poses true.txt");
  std::vector<Eigen::Isometry3d> wrong = poses("true.txt");
  for (std::size_t i = wrong.size() / 2; i < wrong.size(); ++i)
    wrong[i].pretranslate(Eigen::Vector3d(0.055, 0.049, 0.067));  // 10 cm
  write_poses("wrong.txt", wrong);
  run_well("map room --poses wrong.txt -o m --resolution 0.03 --align off --keep-scans kept");
  const auto off = surfaces("m");
  run_well("remap m --poses true.txt -o right --report r.json");
  const auto truth = surfaces("true"), right = surfaces("right");
  // The means of another grid's voxels stand for the same readings.
  expect_same(truth->surfaces, right->surfaces, Eigen::Isometry3d::Identity(), other_points);
  EXPECT_LT(right->surfaces.size(), off->surfaces.size()) << "double layers are gone";
  // Whoever has most of a face's readings keeps its id; what it had twice is gone, into it.
  const json remap = read_json("r.json").at("remap");
  EXPECT_GE(remap.at("kept"), 4);
  EXPECT_FALSE(remap.at("gone").empty());
}

TEST_F(Remap, WrittenPosesAreThoseOfTheScans) {
  write_floor();
  run_well("map floor -o m --write-poses p.txt --checkpoint 0.001");
  const std::vector<Eigen::Isometry3d> given = poses("floor/poses.txt"), used = poses("p.txt");
  ASSERT_EQ(used.size(), given.size());
  for (std::size_t i = 0; i < used.size(); ++i)
    EXPECT_LT((used[i].matrix() - given[i].matrix()).norm(), 1e-12);
  EXPECT_NEAR(io::read_poses(folder / "p.txt").poses[5].stamp_s.value(), 5 / 30.0, 1e-12);
  EXPECT_THAT(error_of("map floor -o n --write-poses p.txt", 2), HasSubstr("p.txt: exists already"));
  EXPECT_THAT(error_of("map floor -o n --write-poses floor/poses.txt --force", 2),
              HasSubstr("--write-poses"));
  EXPECT_THAT(error_of("map floor -o n --write-poses n.bt", 2), HasSubstr("--write-poses"));
  EXPECT_THAT(error_of("map floor -o n --write-poses q --report q", 2), HasSubstr("--write-poses"));
}

TEST_F(Remap, AMapGoesOnWithItsScans) {
  write_floor();
  run_well("map floor -o whole --keep-scans whole.scans");
  run_well("map floor -o m --keep-scans m.scans --first 3");
  const Outcome fork = run_well("map floor --resume m -o fork --skip 3");
  ASSERT_EQ(fork.errors.size(), 1U);
  EXPECT_THAT(fork.errors[0], HasSubstr("--keep-scans COPY"));
  EXPECT_TRUE(load_map(folder / "fork").scans.folder.empty());
  EXPECT_EQ(files_in("m.scans"), 3U);
  EXPECT_THAT(error_of("map floor --resume m -o own --keep-scans own.scans --skip 3", 1),
              HasSubstr("000000"));
  EXPECT_THAT(error_of("map floor --resume m -o own --keep-scans m.scans --skip 3", 2),
              HasSubstr("another map"));
  fs::copy(folder / "m.scans", folder / "own.scans");
  run_well("map floor --resume m -o own --keep-scans own.scans --skip 3");
  same_scans("own.scans", "whole.scans", 6);
  EXPECT_EQ(files_in("own.scans"), 6U);
  EXPECT_EQ(files_in("m.scans"), 3U);
  run_well("map floor --resume m --skip 3");  // by itself
  same_scans("m.scans", "whole.scans", 6);
  EXPECT_TRUE(read("m.bt") == read("whole.bt"));
  run_well("map whole.scans -o again");  // read like other scans
  EXPECT_TRUE(read("again.bt") == read("whole.bt"));

  fs::remove_all(folder / "m.scans");
  const Outcome gone = run_well("map floor --resume m");
  ASSERT_EQ(gone.errors.size(), 1U);
  EXPECT_THAT(gone.errors[0], HasSubstr("are not there"));
  EXPECT_THAT(error_of("remap m", 2), HasSubstr("not kept"));
}

TEST_F(Remap, ARemappedMapDoesNotWriteIntoTheOthersFolder) {
  write_floor();
  run_well("map floor -o m --keep-scans kept");
  run_well("remap m -o n");
  EXPECT_THAT(error_of("map floor --resume n --keep-scans kept", 2), HasSubstr("another map"));
  EXPECT_EQ(run_well("map floor --resume n -o o").errors.size(), 1U);
  EXPECT_EQ(files_in("kept"), 6U);
  fs::copy(folder / "kept", folder / "n.scans");
  run_well("map floor --resume n --keep-scans n.scans");
  EXPECT_EQ(files_in("n.scans"), 12U);
}

TEST_F(Remap, WhatCannotBeDoneIsSaid) {
  write_floor();
  run_well("map floor -o plain");
  EXPECT_THAT(error_of("remap plain", 2), HasSubstr("--keep-scans"));
  EXPECT_THAT(error_of("remap", 2), HasSubstr("map is required"));
  EXPECT_THAT(error_of("remap nowhere", 1), HasSubstr("there is no such map"));
  EXPECT_THAT(error_of("map floor --resume plain --keep-scans s", 2), HasSubstr("6 scans"));
  EXPECT_THAT(error_of("map floor -o n --keep-scans floor", 2), HasSubstr("--keep-scans"));
  EXPECT_THAT(error_of("map plain.bt -o n --keep-scans s", 2), HasSubstr("octree"));
  run_well("map floor -o m --keep-scans kept");
  EXPECT_THAT(error_of("map floor -o n --keep-scans kept", 2), HasSubstr("not an empty folder"));
  EXPECT_THAT(error_of("remap m -o plain", 2), HasSubstr("exists already"));
  EXPECT_THAT(error_of("remap m --report m.bt", 2), HasSubstr("--report"));
  write("five.txt", "0 0 1 1 0 0 0\n0 0 1 1 0 0 0\n");
  EXPECT_THAT(error_of("remap m --poses five.txt", 1), AllOf(HasSubstr("2 poses"), HasSubstr("6 scans")));
  write("late.txt", "9 0 0 1 1 0 0 0\n9.01 0 0 1 1 0 0 0\n");
  EXPECT_THAT(error_of("remap m --poses late.txt", 1), HasSubstr("at its time"));
  const std::string before = read("m.surfaces");
  fs::rename(folder / "kept", folder / "moved");
  EXPECT_THAT(error_of("remap m", 1), HasSubstr("000000"));
  run_well("remap m --scans moved -o n");
  fs::remove(io::kept_scans(folder / "moved", 6)[4]);
  EXPECT_THAT(error_of("remap m --scans moved", 1), HasSubstr("000004"));
  EXPECT_EQ(read("m.surfaces"), before);
}

/// Whenever it is killed, map and scans go on together, and end as if nothing had been.
TEST_F(Remap, KilledAtAnyMomentMapAndScansAgree) {
  constexpr int images = 20;
  write_floor("floor", images);
  run_well("map floor -o whole --keep-scans whole.scans");
  run_well("map floor -o seed --first 2 --keep-scans seed.scans");
  std::mt19937_64 random(seed());
  const auto begin_anew = [&] {
    for (const char* ending : {".surfaces", ".bt"})
      fs::copy_file(folder / (std::string("seed") + ending), folder / (std::string("m") + ending),
                    fs::copy_options::overwrite_existing);
  };
  const std::vector<std::string> going_on{"map", "floor",        "--resume", "m",         "--skip",
                                          "2",   "--checkpoint", "0.01",     "--threads", "1"};
  begin_anew();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(Running(folder, going_on).wait(), 0);
  const auto whole = std::chrono::steady_clock::now() - start;
  for (int kill = 0; kill < 6; ++kill) {
    begin_anew();
    {
      Running run(folder, going_on);
      std::this_thread::sleep_for(whole * std::uniform_real_distribution<double>(0.1, 0.95)(random));
      run.send(SIGKILL);
      run.wait();
    }
    const std::size_t scans = load_map(folder / "m").map.size().scans;
    EXPECT_NO_THROW(io::kept_scans(folder / "seed.scans", scans));
    if (scans < images) run_well("map floor --resume m --skip " + std::to_string(scans));
    EXPECT_TRUE(read("m.bt") == read("whole.bt")) << "killed after " << scans;
    same_scans("seed.scans", "whole.scans", images);
    run_well("remap m -o n --force");
  }
}

}  // namespace
}  // namespace octosurf::test
