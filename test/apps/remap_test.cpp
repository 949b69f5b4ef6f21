// Maps that are built anew from scans that were kept, `octosurf merge` on maps of the two halves of a room,
// and `octosurf diff` of one from which a table went.
#include "apps/command.hpp"
#include "io/kept_scans.hpp"
#include "io/readers/pose_file.hpp"
#include "property/same_surfaces.hpp"
#include "support/scene.hpp"
#include "support/unshared_area.hpp"

namespace octosurf::test {
namespace {

class Remap : public CommandTest {
 protected:
  std::vector<Eigen::Isometry3d> poses(const std::string& file) const {
    std::vector<Eigen::Isometry3d> all;
    for (const io::FilePose& pose : io::read_poses(folder / file).poses) all.push_back(pose.T);
    return all;
  }
  void expect_poses(const std::string& file, const std::vector<Eigen::Isometry3d>& expected) const {
    const std::vector<Eigen::Isometry3d> found = poses(file);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_LT((found[i].matrix() - expected[i].matrix()).norm(), 1e-12);
  }
  std::size_t files_in(const std::string& scans) const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder / scans), {}));
  }
  void same_scans(const std::string& a, const std::string& b) const {
    EXPECT_EQ(files_in(a), files_in(b));
    for (const fs::path& scan : io::kept_scans(folder / a, files_in(a))) {
      const std::string name = "/" + scan.filename().string();
      EXPECT_TRUE(read(a + name) == read(b + name)) << scan;
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
    std::vector<Eigen::Isometry3d> poses;
    for (int i = 0; i < images; ++i) {
      const double a = 1.6 * i / images;
      poses.push_back(look_at({0.4 + 1.9 * std::cos(a), 0.4 + 1.9 * std::sin(a), 1.5}, {0.2, 0.2, 0.5}));
    }
    write_images("room", scene, poses);
  }
  void write_images(const std::string& name, const Scene& scene,
                    const std::vector<Eigen::Isometry3d>& poses) const {
    const Camera camera{.width = 160, .height = 120, .focal = 130};
    std::mt19937_64 random = rng();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Scan scan = camera_scan(scene, poses[i], random, camera);
      write_depths(name + "/" + std::to_string(i) + ".pgm", 160, 120, [&](int u, int v) {
        const Eigen::Vector3f& p = scan.points[static_cast<std::size_t>(160 * v + u)];
        return p.allFinite() ? 1000.0 * p.z() : 0;
      });
    }
    write_poses(name + "/poses.txt", poses, 30);
    write(name + "/intrinsics.txt", "130 130 79.5 59.5\n");
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
  EXPECT_THAT(run_well("remap m -o n --report r.json").out, says("0 new; 0 of those before are gone"));
  EXPECT_TRUE(read("m.bt") == read("n.bt"));
  const json report = read_json("r.json"), remap = report.at("remap");
  EXPECT_EQ(remap.at("kept"), report.at("surfaces"));
  EXPECT_EQ(remap.at("new"), 0);
  EXPECT_THAT(remap.at("gone"), IsEmpty());
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
  write_poses("moved.txt", corrected, 30);
  const auto before = surfaces("m");
  run_well("remap m --poses moved.txt --write-poses used.txt");  // in place
  const auto after = surfaces("m");
  EXPECT_GE(expect_ids(*before, *after, T), 4U);
  expect_same(before->surfaces, after->surfaces, T, other_points);
  expect_poses("used.txt", corrected);

  // And back: the map knows its poses, the scans those of the beginning.
  run_well("remap m --poses p.txt");
  EXPECT_GE(expect_ids(*before, *surfaces("m"), Eigen::Isometry3d::Identity()), 4U);
  run_well("map room --resume m --skip 11");
  EXPECT_EQ(files_in("kept"), 13U);
  surfaces("m");  // is sound
  run_well("remap m");
}

TEST_F(Remap, ARecordingWhoseSecondHalfIsOffIsPutRight) {
  write_room();
  run_well("map room -o true --resolution 0.03 --keep-scans true.scans --write-poses true.txt");
  std::vector<Eigen::Isometry3d> wrong = poses("true.txt");
  for (std::size_t i = wrong.size() / 2; i < wrong.size(); ++i)
    wrong[i].pretranslate(Eigen::Vector3d(0.055, 0.049, 0.067));  // 10 cm
  write_poses("wrong.txt", wrong, 30);
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

TEST_F(Remap, WrongPosesAreToldAsMapTellsThem) {
  write_room();
  run_well("map room -o m --resolution 0.04 --keep-scans kept --write-poses p.txt");
  EXPECT_THAT(run_well("remap m -o n").out, says("66 of 66 pairs of views"));
  std::vector<Eigen::Isometry3d> wrong = poses("p.txt");
  for (std::size_t i = 0; i < wrong.size(); i += 2) wrong[i].pretranslate(Eigen::Vector3d(0.3, 0.2, 0.25));
  write_poses("wrong.txt", wrong, 30);
  EXPECT_THAT(run_well("remap m --poses wrong.txt -o n --force").err,
              says("warning: scans contradict each other"));
  const std::string before = read("n.surfaces");
  fails("remap m --poses wrong.txt -o n --force --strict",
        {"scans contradict each other", "no map is written"});
  EXPECT_EQ(read("n.surfaces"), before);
}

TEST_F(Remap, TakesPosesFarFromZero) {
  write_room();
  run_well("map room -o m --resolution 0.04 --keep-scans kept --write-poses p.txt");
  const Eigen::Vector3d utm(448000, 5411000, 120);
  std::vector<Eigen::Isometry3d> far = poses("p.txt");
  for (Eigen::Isometry3d& pose : far) pose.pretranslate(utm);
  write_poses("utm.txt", far, 30);
  fails("remap m --poses utm.txt -o n", {"--origin X Y Z"});
  run_well("remap m --poses utm.txt --origin 448000 5411000 120 -o n --write-poses used.txt");
  const LoadedMap there = load_map(folder / "n");
  EXPECT_EQ(there.map.origin(), utm);
  EXPECT_GE(expect_ids(*surfaces("m"), *there.map.snapshot(), Eigen::Isometry3d::Identity()), 4U);
}

TEST_F(Remap, WrittenPosesAreThoseOfTheScans) {
  write_floor();
  run_well("map floor -o m --write-poses p.txt --checkpoint 0.001");
  expect_poses("p.txt", poses("floor/poses.txt"));
  EXPECT_NEAR(io::read_poses(folder / "p.txt").poses[5].stamp_s.value(), 5 / 30.0, 1e-12);
  wrong_use("map floor -o n --write-poses p.txt", {"p.txt: exists already"});
  for (const char* taken : {"floor/poses.txt --force", "n.bt", "q --report q"})
    wrong_use(std::string("map floor -o n --write-poses ") + taken, {"--write-poses"});
}

TEST_F(Remap, AMapGoesOnWithItsScans) {
  write_floor();
  run_well("map floor -o whole --keep-scans whole.scans");
  run_well("map floor -o m --keep-scans m.scans --first 3");
  const Outcome fork = run_well("map floor --resume m -o fork --skip 3");
  ASSERT_EQ(fork.errors.size(), 1U);
  EXPECT_THAT(fork.errors[0], says("--keep-scans COPY"));
  EXPECT_TRUE(load_map(folder / "fork").scans.folder.empty());
  EXPECT_EQ(files_in("m.scans"), 3U);
  fails("map floor --resume m -o own --keep-scans own.scans --skip 3", {"holds 0 of the map's 3 scans"});
  wrong_use("map floor --resume m -o own --keep-scans m.scans --skip 3", {"another map"});
  fs::copy(folder / "m.scans", folder / "own.scans");
  run_well("map floor --resume m -o own --keep-scans own.scans --skip 3");
  same_scans("own.scans", "whole.scans");
  EXPECT_EQ(files_in("m.scans"), 3U);
  run_well("map floor --resume m --skip 3");  // by itself
  same_scans("m.scans", "whole.scans");
  EXPECT_TRUE(read("m.bt") == read("whole.bt"));
  run_well("map whole.scans -o again");  // read like other scans
  EXPECT_TRUE(read("again.bt") == read("whole.bt"));
  // A remapped map does not write into the folder of the other.
  run_well("remap m -o n");
  wrong_use("map floor --resume n --keep-scans m.scans", {"another map"});
  EXPECT_EQ(run_well("map floor --resume n -o o").errors.size(), 1U);
  EXPECT_EQ(files_in("m.scans"), 6U);
  run_well("map floor --resume n --keep-scans own.scans");
  EXPECT_EQ(files_in("own.scans"), 12U);

  fs::remove_all(folder / "m.scans");
  const Outcome gone = run_well("map floor --resume m");
  ASSERT_EQ(gone.errors.size(), 1U);
  EXPECT_THAT(gone.errors[0], says("are not there"));
  wrong_use("remap m", {"not kept"});
}

/// A backup of a map is gone on with, in the folder that its own scans of later are in.
TEST_F(Remap, ScansOfAnotherMapAreNeitherDeletedNorUsed) {
  write_floor("floor", 9);
  write_floor("other", 9, 0.0005);
  run_well("map floor -o m --first 3 --keep-scans scans");
  for (const std::string ending : {".surfaces", ".bt"})
    fs::copy(folder / ("m" + ending), folder / ("backup" + ending));
  run_well("map floor --resume m --skip 3 --first 3");
  fs::copy(folder / "scans", folder / "whole");

  // What a killed run of the map has left is not another's.
  fs::copy(folder / "backup.surfaces", folder / "m.surfaces", fs::copy_options::overwrite_existing);
  run_well("map floor --resume m --skip 3 --first 3");
  same_scans("scans", "whole");

  const Outcome forked = run_well("map other --resume backup --skip 3 --first 3");
  EXPECT_THAT(forked.err, says("warning: scans: ", "scans/aside"));
  for (const fs::path& scan : io::kept_scans(folder / "whole", 6)) {
    const std::string name = scan.filename().string(), aside = "scans/aside/" + name;
    EXPECT_EQ(read(exists(aside) ? aside : "scans/" + name), read(scan.string())) << name;
  }
  run_well("remap backup -o n");
  const std::string before = read("m.surfaces");
  for (const std::string verb : {"remap m -o o", "map other --resume m --skip 5"})
    fails(verb, {"scans/000003_0.1", "is not the scan that the map was built from"});
  EXPECT_THAT(run_well("export m --to m.mcap").err, says("warning: ", "is not the scan"));
  EXPECT_EQ(read("m.surfaces"), before);
  run_well("remap m --scans whole -o o");

  // Poses corrected in place: the files have those of before, and are the map's nevertheless.
  run_well("remap o");
  write_poses("moved.txt", floor_poses(6, 0.02));
  run_well("remap m --scans whole --poses moved.txt");
  run_well("remap m --scans whole -o p");
  fails("remap m --scans scans -o q", {"is not the scan"});
}

TEST_F(Remap, WhatCannotBeDoneIsSaid) {
  write_floor();
  run_well("map floor -o plain");
  wrong_use("remap plain", {"--keep-scans"});
  wrong_use("remap plain --scans floor", {"--keep-scans"});
  wrong_use("remap", {"map is required"});
  fails("remap nowhere", {"there is no such map"});
  wrong_use("map floor --resume plain --keep-scans s", {"6 scans"});
  wrong_use("map floor -o n --keep-scans floor", {"--keep-scans"});
  wrong_use("map plain.bt -o n --keep-scans s", {"octree"});
  run_well("map floor -o m --keep-scans kept");
  wrong_use("map floor -o n --keep-scans kept", {"not an empty folder"});
  wrong_use("remap m -o plain", {"exists already"});
  wrong_use("remap m --report m.bt", {"--report"});
  write_poses("two.txt", floor_poses(2));
  fails("remap m --poses two.txt", {"2 poses", "6 scans"});
  write("late.txt", "9 0 0 1 1 0 0 0\n9.01 0 0 1 1 0 0 0\n");
  fails("remap m --poses late.txt", {"at its time"});
  const std::string before = read("m.surfaces");
  fs::rename(folder / "kept", folder / "moved");
  fails("remap m", {"holds 0 of the map's 6 scans"});
  run_well("remap m --scans moved -o n");
  fs::remove(io::kept_scans(folder / "moved", 6)[4]);
  fails("remap m --scans moved", {"holds 5 of the map's 6 scans"});
  EXPECT_EQ(read("m.surfaces"), before);
}

class Merge : public CommandTest {
 protected:
  /// left, right: halves of a room that overlap; all: the room. right_elsewhere: right, in a frame that lies
  /// 1 m along y and a quarter turn about z from the others'.
  Merge() {
    made_once("halves" + std::to_string(seed()), [this] { make(); });
  }
  void make() const {
    std::mt19937_64 random = rng();
    Scene scene;
    scene.rectangle({-2, -1.5, 0}, {4, 0, 0}, {0, 3, 0});
    scene.rectangle({-2, 1.5, 0}, {4, 0, 0}, {0, 0, 1.6});
    scene.box({-0.5, -0.4, 0}, {0.5, 0.4, 0.5});
    // Seen from both halves, and not along x.
    scene.rectangle({-0.6, 1.4, 0}, {0.6, -0.5, 0}, {0, 0, 1.6})
        .rectangle({0, 0.9, 0}, {0.6, 0.5, 0}, {0, 0, 1.6});
    const Parameters coarse = test::of_voxels(0.04);
    Mapper left(coarse), right(coarse), all(coarse), elsewhere(coarse);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().y() = 1;
    T.linear() << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    for (int i = 0; i < 12; ++i) {
      const double side = i % 2 == 0 ? -1 : 1;
      const Scan scan = camera_scan(
          scene, look_at({0.7 * side, -1.2, 1.5}, {(0.2 + 0.1 * i) * side, 0.5 + 0.5 * std::sin(i), 0.2}),
          random);
      (side < 0 ? left : right).insert(scan);
      all.insert(scan);
      if (side > 0) elsewhere.insert(moved(scan, T.inverse()));
    }
    save_map(left.map(), folder / "left");
    save_map(right.map(), folder / "right");
    save_map(all.map(), folder / "all");
    save_map(elsewhere.map(), folder / "right_elsewhere");
  }
  double apart_m2(const std::string& a, const std::string& b) const {
    const LoadedMap one = load_map(folder / a), other = load_map(folder / b);
    return unshared_area(*one.map.snapshot(), *other.map.snapshot()) +
           unshared_area(*other.map.snapshot(), *one.map.snapshot());
  }
};

/// With the scans' poses and intrinsics by name.
const std::string map_floor = "map floor --poses floor/poses.txt --intrinsics floor/intrinsics.txt ";

TEST_F(Merge, MakesOneMapOfTwoThatCanBeGoneOnWith) {
  const std::string left = read("left.surfaces");
  const std::string printed = run_well("merge left right -o both").out;
  const json both = info("both");
  EXPECT_EQ(both.at("scans"), 12);
  EXPECT_LT(apart_m2("both", "all"), 0.8) << "of some 20 m²";
  EXPECT_THAT(printed, says("first", "written      both.surfaces, both.bt",
                            "merged       " + both.at("surfaces").dump() + " surfaces, ", " go on, "));
  EXPECT_EQ(read("left.surfaces"), left);
  EXPECT_TRUE(exists("both.bt"));
  write_floor();
  run_well(map_floor + "--resume both -o both");
  EXPECT_EQ(info("both").at("scans"), 18);
}

TEST_F(Merge, WritesOverWithForceOnly) {
  const std::string left = read("left.surfaces");
  wrong_use("merge left right -o left", {"--force"});
  EXPECT_EQ(read("left.surfaces"), left);
  run_well("merge left right -o left --force");
  EXPECT_EQ(info("left").at("scans"), 12);
  wrong_use("merge left right", {"--output"});
  wrong_use("merge right right -o twice", {"given twice"});
  wrong_use("merge right ./right.surfaces -o twice", {"given twice"});
  wrong_use("merge left right all -o both", {"all"});
  fails("merge left nothing -o both", {"nothing"});
}

TEST_F(Merge, TakesThePoseOfTheSecondFrameOrFindsItFromAGuess) {
  run_well("merge left right_elsewhere -o stated --pose 0 1 0 0 0 90");
  EXPECT_LT(apart_m2("stated", "all"), 1.2);
  EXPECT_EQ(run("merge left right_elsewhere -o none --pose 0 1 0").code, 2);
  const std::string guessed = "merge left right_elsewhere -o both --pose 0.1 1.05 -0.04 1 -1 92";
  fails(guessed, {"where its surfaces meet", "--align"});
  EXPECT_FALSE(exists("both.surfaces"));
  const std::string printed = run_well(guessed + " --align").out;
  EXPECT_THAT(printed, says("6 of 6 directions fixed"));
  std::istringstream pose(printed.substr(printed.find("--pose ") + 7));
  constexpr double within = 0.005, within_deg = 0.28;  // m; of 5 mm at a metre
  for (const auto& [truth, most] :
       {std::pair(0, within), {1, within}, {0, within}, {0, within_deg}, {0, within_deg}, {90, within_deg}}) {
    double found = NAN;
    pose >> found;
    EXPECT_NEAR(found, truth, most);
  }
  EXPECT_LT(apart_m2("both", "all"), 1.2);
  run_well(guessed + " --anyway --force");
  fails("merge left right_elsewhere -o none --pose 30 0 0 0 0 0 --align", {"--pose"});
  EXPECT_FALSE(exists("none.surfaces"));
}

/// Two maps of other places, each about its own 0, and two that lie apart.
TEST_F(Merge, RefusesMapsThatShareNoPlace) {
  write_floor();
  run_well("map floor -o floor --resolution 0.04");
  fails("merge left floor -o both --pose 0 0 30 0 0 0", {"no place in common with left", "--anyway"});
  fails("merge left floor -o both --pose 0 0 0.8 90 0 0", {"does not fit left"});
  EXPECT_FALSE(exists("both.surfaces") || exists("both.lock"));
  run_well("merge left floor -o both --pose 0 0 30 0 0 0 --anyway");
}

TEST_F(Merge, RefusesScansThatBothHold) {
  write_floor();
  run_well(map_floor + "-o one --first 4");
  run_well(map_floor + "-o two --skip 3");
  fails("merge one two -o both", {"holds 1 scan of one"});
  run_well("merge one two -o both --anyway");
  EXPECT_EQ(info("both").at("scans"), 7);
}

class Diff : public CommandTest {
 protected:
  /// before: a floor and a table; after: resumed without the table; other: another map, of the floor alone.
  Diff() {
    made_once("table" + std::to_string(seed()), [this] { make(); });
  }
  void make() const {
    std::mt19937_64 random = rng();
    Scene empty, full;
    empty.rectangle({-1.5, -1.5, 0}, {3, 0, 0}, {0, 3, 0});
    full = empty;
    full.box({-0.4, -0.3, 0}, {0.4, 0.3, 0.4});
    const auto look = [&](Mapper& mapper, const Scene& scene, int scans, const std::string& map) {
      for (int i = 0; i < scans; ++i)
        mapper.insert(camera_scan(
            scene, look_at({1.6 * std::cos(0.7 * i), 1.6 * std::sin(0.7 * i), 1.4}, {0, 0, 0.1}), random));
      save_map(mapper.map(), folder / map);
    };
    Mapper mapper(test::of_voxels(0.04)), other(test::of_voxels(0.04));
    look(mapper, full, 9, "before");
    look(mapper, empty, 18, "after");
    look(other, empty, 9, "other");
  }
};

TEST_F(Diff, TellsByIdsWhatWentAndWhatGrew) {
  const json difference = json_of("diff --json before after");
  EXPECT_EQ(difference.at("revision_before"), 9);
  EXPECT_EQ(difference.at("revision_after"), 27);
  double gone = 0, grown = 0;
  for (const json& one : difference.at("gone")) gone += one.at("area_m2").get<double>();
  for (const json& one : difference.at("changed"))
    grown += one.at("area_after_m2").get<double>() - one.at("area_before_m2").get<double>();
  EXPECT_NEAR(gone, 0.48 + 2 * 0.4 * (0.8 + 0.6), 0.4) << "its top and its sides";
  EXPECT_NEAR(grown, 0.48, 0.15) << "the floor under it";
  EXPECT_THAT(run_well("diff before after").out, says("revision before", "gone 5"));
  const json same = json_of("diff --json before before");
  for (const char* list : {"appeared", "changed", "gone", "merged", "split"})
    EXPECT_TRUE(same.at(list).empty()) << list;
}

TEST_F(Diff, MapsThatDoNotGoOnFromOneAnotherAreRefused) {
  fails("diff before other", {"other: does not go on from before", "--resume before -o other"});
  fails("diff after before", {"does not go on from after"});
  fails("diff before nothing", {"nothing"});
}

}  // namespace
}  // namespace octosurf::test
