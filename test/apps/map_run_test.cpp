// What `octosurf map` makes of good input, and of readings in another unit, cut by a limit that nobody
// stated, or with poses that are not T_map_sensor or jump: no map without a word.
#include "apps/command.hpp"

#include <iomanip>
#include <octomap/octomap.h>
#include <regex>
#include <sstream>

namespace octosurf::test {
namespace {

class MapRun : public CommandTest {
 protected:
  /// A slab a voxel thick at z in [0, 0.05), `length` voxels × 1 m, with free space above it.
  void write_slab(const std::string& name, int length = 20) const {
    octomap::OcTree tree(0.05);
    const auto middle = [](int i) { return 0.05F * static_cast<float>(i) + 0.025F; };
    for (int x = 0; x < length; ++x)
      for (int y = 0; y < 20; ++y)
        for (int z = 0; z < 4; ++z)
          tree.updateNode(octomap::point3d(middle(x), middle(y), middle(z)), z == 0);
    tree.writeBinary((folder / name).string());
  }
};

TEST_F(MapRun, SaysThatScansContradictEachOther) {
  write_floor("floor", 16);
  const Outcome right = run_well("map floor -o right --align off --strict --report right.json");
  EXPECT_THAT(right.out, ::testing::ContainsRegex("\nagreement    ([0-9]+) of [0-9]+ pairs of views\n"));
  EXPECT_THAT(right.err, Not(HasSubstr("contradict")));
  EXPECT_EQ(read_json("right.json").at("judgement").at("contradicts"), false);
  std::vector<Eigen::Isometry3d> poses = floor_poses(16);
  for (std::size_t i = 12; i < 16; ++i) poses[i].translation().z() -= 0.3;
  write_poses("floor/poses.txt", poses);
  const Outcome warned = run_well("map floor -o warned --align off --report warned.json");
  ASSERT_EQ(warned.errors.size(), 1U);
  EXPECT_THAT(
      warned.errors[0],
      ::testing::MatchesRegex("warning: scans contradict each other: .* pairs of views do, most floor/.*"));
  EXPECT_NEAR(read_json("warned.json").at("judgement").at("axis")[2], 1, 1e-6);
  const std::string before = read("right.surfaces");
  const Outcome strict = run("map floor -o right --force --align off --strict");
  EXPECT_EQ(strict.code, 1);
  EXPECT_THAT(strict.err, says("contradict each other", "no map is written"));
  EXPECT_TRUE(read("right.surfaces") == before);
  // A floor alone fixes no motion, so check names none that would make it agree.
  EXPECT_THAT(warned.errors[0], HasSubstr("; octosurf check floor --align off finds the cause"));
  EXPECT_THAT(run_well("check floor").out, HasSubstr("agree with each other as `map` maps them"));  // aligned
  const Outcome check = run("check floor --align off");
  EXPECT_EQ(check.code, 1);
  EXPECT_THAT(check.out, says("as given ", " pairs of views contradict each other"));
  EXPECT_THAT(check.err, says("most floor/", "the cause is not among those known"));
  wrong_use("check", {"input"});
}

TEST_F(MapRun, FindsTheFloor) {
  write_floor();
  const Outcome run = run_well("map floor -o m");
  EXPECT_THAT(run.out, says("scans        6\n", "surfaces     1,", "m.surfaces, m.bt"));
  EXPECT_THAT(run.errors, IsEmpty());
  const json contents = info("m"), floor = contents.at("largest").at(0);
  EXPECT_EQ(contents.at("scans"), 6);
  EXPECT_EQ(contents.at("surfaces"), 1);
  EXPECT_EQ(contents.at("points"),
            contents.at("inliers").get<int>() + contents.at("pending_points").get<int>());
  EXPECT_NEAR(floor.at("normal").at(2), 1, 1e-6);
  EXPECT_NEAR(floor.at("offset"), floor_height, 1e-4);  // stored to 1/256 voxel
  // Six images, each 79/60 m × 59/60 m between its outermost pixels' centres and 0.1 m further; a pixel sees
  // 1/60 m, and a voxel's point is inside the voxel by up to a voxel.
  const double length = 79.0 / 60 + 0.5, width = 59.0 / 60, pixel = 1.0 / 60;
  EXPECT_LE(floor.at("area_m2"), (length + pixel) * (width + pixel));
  EXPECT_GE(floor.at("area_m2"), (length - 0.04) * (width - 0.04));
  EXPECT_NEAR(contents.at("extent").at("max").at(0), 39.5 / 60 + 0.5, 0.02);
}

TEST_F(MapRun, WhatWaitsIsLookedAtWhereScansPauseAndInTheEnd) {
  write_floor("floor", 4);
  const auto drained = [&](const std::string& options) {
    run_well("map floor -o m --force --report r.json --detection-budget 20" + options);
    const json report = read_json("r.json");
    EXPECT_GT(report.at("waiting_points").at("max"), 0);
    EXPECT_EQ(report.at("surfaces"), 1);
    return report.at("drain_ms").at("count");
  };
  EXPECT_EQ(drained(" --first 1"), 1U) << "in the end";
  write_times("floor", 4, 2);
  EXPECT_EQ(drained(""), 0U) << "the scans that come find all that waits";
  write_times("floor", 4, 0.5);
  EXPECT_EQ(drained(""), 1U) << "before the second, which comes 2 s after the first";
}

TEST_F(MapRun, ReportHasEveryKey) {
  write_floor();
  run_well("map floor -o m --report r.json");
  const json report = read_json("r.json"), contents = info("m");
  const std::string documentation = read(test::paths::source() + "/docs/formats.md"),
                    rows = documentation.substr(0, documentation.find("\n## 2"));
  for (const auto& entry : report.items())
    EXPECT_THAT(rows, says("`" + entry.key() + "`")) << "docs/formats.md does not name it";
  const std::regex row("\\n\\| `(\\w+)`");
  for (std::sregex_iterator key(rows.begin(), rows.end(), row); key != std::sregex_iterator(); ++key)
    EXPECT_TRUE(report.contains((*key)[1])) << (*key)[1];
  const auto expect_positive = [&](const json& group, const std::vector<std::string>& keys, bool or_zero) {
    for (const std::string& key : keys) EXPECT_GT(group.at(key), or_zero ? -1e-300 : 0) << group << key;
  };
  expect_positive(report.at("detection_lag_s"), {"mean", "p50", "p95", "max"}, false);
  expect_positive(report.at("scan_ms"), {"p50", "p95", "p99", "max"}, false);
  expect_positive(report.at("octree"), {"nodes", "leaves", "bytes"}, false);
  EXPECT_EQ(report.at("stage_ms").size(), 10u);
  for (const char* stage : {"align", "downsample", "occupancy", "retract", "add_inliers", "expand", "detect",
                            "revise", "cylinders", "derive"})
    expect_positive(report.at("stage_ms").at(stage), {"p50", "p95", "max", "total"}, true);
  const json expected{{"version", OCTOSURF_VERSION},
                      {"input", {"floor"}},
                      {"scans", 6},
                      {"surfaces", 1},
                      {"points_raw", 6 * floor_points},
                      {"points_dropped", {{"not_finite", 0}, {"too_near", 0}, {"out_of_map", 0}}},
                      {"points_new", contents.at("points")},  // nothing vanished
                      {"area_m2", contents.at("area_m2")},
                      {"pending_points", contents.at("pending_points")},
                      {"octree", contents.at("octree")}};
  for (const auto& [key, value] : expected.items()) EXPECT_EQ(report.at(key), value) << key;
  // Six scans at 30 Hz are 0.2 s of sensor time.
  EXPECT_NEAR(report.at("points_per_second"), report.at("points_new").get<double>() / 0.2, 1e-6);
  EXPECT_NEAR(report.at("categorized_percent"),
              100 * contents.at("inliers").get<double>() / contents.at("points").get<double>(), 1e-9);
  EXPECT_GE(report.at("wall_s"), 1e-3 * report.at("scan_ms").at("max").get<double>());
}

TEST_F(MapRun, StoppingAndResumingGivesTheSameBytes) {
  // A run that ends looks at what waits, which one that goes on leaves to later scans: here nothing does.
  simulate_room();
  run_well("map room -o one --first 6 --resolution 0.05 --threads 1 --detection-budget 0");
  for (const int k : {1, 4}) {
    const std::string scans = std::to_string(k), part = "part" + scans, whole = "whole" + scans;
    run_well("map room -o " + part + " --resolution 0.05 --detection-budget 0 --first " + scans);
    run_well("map room -o " + whole + " --resume " + part + " --skip " + scans + " --first " +
             std::to_string(6 - k));
    EXPECT_TRUE(same_maps(whole, "one"));
    EXPECT_EQ(info(part).at("scans"), k);  // as it was
  }
  run_well("map room --resume part1.surfaces --skip 1 --first 5 --threads 2");  // in place
  EXPECT_TRUE(same_maps("part1", "one"));
}

TEST_F(MapRun, ResumingKeepsTheMapsParametersAndLeavesOutWhatIsMapped) {
  write_floor();
  run_well("map floor -o m --resolution 0.05 --first 2");
  const std::string before = read("m.surfaces");
  wrong_use("map floor --resume m --resolution 0.02", {"resolution", "0.02", "0.05"});
  wrong_use("map floor --resume m --detector paper", {"resumed"});
  wrong_use("map floor --resume m --max-hole-size 0.1", {"max_hole_size"});
  fails("map floor --resume m -o n --report missing/r.json", {"missing"});
  EXPECT_EQ(read("m.surfaces"), before);
  // 0.2 is what it has.
  EXPECT_THAT(
      run_well("map floor --resume m --first 4 --resolution 0.05 --max-hole-size 0.2 --report r.json").out,
      says("2 scans left out"));
  EXPECT_EQ(read_json("r.json").at("scans_mapped_before"), 2);
  EXPECT_EQ(info("m").at("scans"), 4);
  EXPECT_THAT(run_well("map floor --resume m --first 4").out, says("4 scans left out"));
  EXPECT_EQ(info("m").at("scans"), 4);
}

// The paper's goes on where it was stopped, with what it still has pending, and says what it refused.
TEST_F(MapRun, AMapKeepsItsDetector) {
  write_floor();
  run_well("map floor -o one --detector paper --report r.json");
  run_well("map floor -o m --detector paper --first 3");
  run_well("map floor --resume m --skip 3");
  EXPECT_TRUE(same_maps("m", "one"));
  EXPECT_EQ(run_well("info m --digest").out, digest_of(load_map(folder / "one").map) + "\n");
  EXPECT_EQ(read_json("r.json").at("parameters").at("detector"), "paper");
  EXPECT_EQ(info("m").at("surfaces"), 1);
  EXPECT_THAT(run_well("info m").out, says("\ndetector             paper\n"));
  EXPECT_THAT(run_well("explain m --at 0.2 0 0.5").out, says("\ndetector             paper\n"));
  wrong_use("map floor --resume m --detector likelihood", {"detector"});
}

TEST_F(MapRun, NothingMappedIsNoSuccess) {
  write_floor();
  fails("map floor -o new/m --depth-scale 1", {"beyond the maximum range", "--depth-scale"});
  fails("map floor -o new/m --min-range 2", {"nearer than min_range", "--depth-scale"});
  EXPECT_FALSE(exists("new/m.surfaces"));
  run_well("map floor -o new/m");  // in a folder that is made
  for (const auto& [degrees, warning] :
       {std::pair(35, "nothing is level within 15 degrees"), std::pair(180, "is seen from below")}) {
    std::vector<Eigen::Isometry3d> poses = floor_poses();
    for (Eigen::Isometry3d& T : poses)
      T = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitX()) * T;
    write_poses("floor/poses.txt", poses);
    EXPECT_THAT(run_well("map floor --force -o m").err, HasSubstr(warning));
  }
}

TEST_F(MapRun, ACloudThatSaysNothingOfItsViewpointIsSeenFromWhereItCanHaveBeen) {
  // Treads of 30 cm and risers of 17 cm up a slope that the origin lies on.
  std::ostringstream stairs;
  for (int step = 4; step < 14; ++step)
    for (double y = -0.8; y < 0.8; y += 0.01) {
      for (double x = 0; x < 0.3; x += 0.01)
        stairs << 0.3 * step + x << ' ' << y << ' ' << 0.17 * (step + 1) << '\n';
      for (double z = 0; z < 0.17; z += 0.01)
        stairs << 0.3 * step << ' ' << y << ' ' << 0.17 * step + z << '\n';
    }
  write_pcd("stairs.pcd", stairs.str());
  const auto expect_treads = [&](const std::string& map) {
    int up = 0;
    const json contents = info(map);
    for (const json& surface : contents.at("largest")) {
      EXPECT_LT(surface.at("slope_deg"), 170) << "a tread that faces down";
      up += surface.at("slope_deg") < 10;
    }
    EXPECT_GE(up, 5);
  };
  EXPECT_THAT(
      run_well("map stairs.pcd -o m").out,
      says("resolution: 5 cm, as of a lidar's scans", "does not say where it was seen from", "--viewpoint"));
  expect_treads("m");
  EXPECT_THAT(run_well("map stairs.pcd -o n --viewpoint 2 0.1 4").out, Not(HasSubstr("--viewpoint")));
  expect_treads("n");
}

TEST_F(MapRun, FarFromZeroAMapIsTheSameAndKeepsItsOrigin) {
  write_floor("near");
  write_floor("far");
  std::vector<Eigen::Isometry3d> poses = floor_poses();
  for (Eigen::Isometry3d& pose : poses) pose.pretranslate(Eigen::Vector3d(448000, 5411000, 119));
  write_poses("far/poses.txt", poses);
  const std::string shift = "448000 5411000 119";
  const json origin{448000.0, 5411000.0, 119.0};
  run_well("map near -o n");
  EXPECT_THAT(run_well("map far -o f --report r.json --write-poses p.txt").out,
              says("origin: " + shift + " m"));
  const json near = info("n"), far = info("f"), floor = far.at("largest").at(0);
  EXPECT_EQ(far.at("origin"), origin);
  EXPECT_EQ(read_json("r.json").at("origin"), origin);
  EXPECT_EQ(near.at("points"), far.at("points"));
  EXPECT_NEAR(floor.at("offset"), floor_height, 1e-4);
  EXPECT_NEAR(floor.at("area_m2"), near.at("largest").at(0).at("area_m2"), 1e-6);
  std::istringstream used(read("p.txt"));
  std::string comment;
  std::getline(used, comment);
  double stamp = 0, x = 0, y = 0;
  used >> stamp >> x >> y;
  EXPECT_NEAR(y, 5411000, 1);
  EXPECT_THAT(run_well("export f --to f.json").err, says(shift));
  EXPECT_THAT(run_well("query f --below 0 0 1 --json").err, says(shift));
  EXPECT_EQ(read_json("f.json").at("origin"), origin);
  // It resumes with its own, whatever is far or near.
  EXPECT_THAT(run_well("map far --resume f").out, says("they are in the map already"));
  wrong_use("map far --resume f --origin 1 2 3", {shift});
  wrong_use("map near -o m --origin 1 2", {"X Y Z"});
}

TEST_F(MapRun, ThatNoScanHasAPoseIsSaid) {
  write_pcd("still/0.pcd", "30 0 0\n");
  write_pcd("still/1.pcd", "30 0 0\n");
  EXPECT_THAT(run_well("map still -o m --resolution 0.05").err,
              says("all scans (2)", "--poses", "--viewpoint"));
  EXPECT_THAT(run_well("map still -o at --resolution 0.05 --viewpoint 0 0 0").err, Not(HasSubstr("--poses")));
}

TEST_F(MapRun, TheResolutionIsTheSensorsUnlessStated) {
  write_floor();
  write_pcd("still.pcd", "3 0 0\n");
  const auto resolution = [&](const std::string& run) {
    run_well("map " + run + " -o m --force");
    return info("m").at("resolution").get<double>();
  };
  EXPECT_EQ(resolution("floor"), 0.02);
  EXPECT_EQ(resolution("still.pcd"), 0.05);
  EXPECT_EQ(resolution("still.pcd --sensor camera"), 0.02);
  EXPECT_EQ(resolution("still.pcd --resolution 0.03"), 0.03);
  run_well("map floor -o m --force");
  run_well("map still.pcd --resume m");
  EXPECT_EQ(info("m").at("resolution"), 0.02);
}

TEST_F(MapRun, PosesMayBeOfTheScansThatAreReadAlone) {
  write_floor();
  std::vector<Eigen::Isometry3d> poses = floor_poses();
  poses.pop_back();
  write_poses("five.txt", poses);
  fails("map floor -o m --poses five.txt", {"5 poses for 6 scans", "--first"});
  run_well("map floor -o m --poses five.txt --first 5");
  EXPECT_EQ(info("m").at("scans"), 5);
  run_well("map floor -o m --force --poses five.txt --skip 1 --skip-bad");
  EXPECT_EQ(info("m").at("scans"), 5);
}

TEST_F(MapRun, SeveralInputsAreOneRecording) {
  write_floor("a", 2);
  write_floor("b", 3);
  run_well("map a b -o m --report r.json");
  EXPECT_EQ(read_json("r.json").at("input"), json({"a", "b"}));
  EXPECT_EQ(read_json("r.json").at("scans"), 5);
  run_well("map b -o some --every 2 --report s.json");
  EXPECT_EQ(read_json("s.json").at("scans"), 2);  // of three: the first and the last
  EXPECT_NEAR(info("some").at("extent").at("max").at(0), 39.5 / 60 + 0.2, 0.02);
}

/// Poses in a frame of their own, as odometry's: the map's turned by 180° about the vertical, and shifted.
TEST_F(MapRun, ASessionInAnotherFrameFindsItselfInTheMap) {
  run_well("simulate office -o office --sensor spinning --frames 24");
  std::istringstream lines(read("office/poses.txt"));
  std::ostringstream session, tilted;
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()));
  std::vector<double> places;  // x in the map
  session << std::setprecision(15);
  tilted << std::setprecision(15);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream numbers(line);
    double stamp, x, y, z, qx, qy, qz, qw;
    if (!(numbers >> stamp >> x >> y >> z >> qx >> qy >> qz >> qw)) continue;
    places.push_back(x);
    session << stamp << ' ' << 7 - x << ' ' << -4 - y << ' ' << z << ' ' << -qy << ' ' << qx << ' ' << qw
            << ' ' << -qz << '\n';
    tilted << stamp << ' ' << (tilt * Eigen::Vector3d(x, y, z)).transpose() << ' '
           << (tilt * Eigen::Quaterniond(qw, qx, qy, qz)).coeffs().transpose() << '\n';
  }
  ASSERT_EQ(places.size(), 24U);
  write("session.txt", session.str());
  write("tilted.txt", tilted.str());
  run_well("map office -o m --first 12");
  run_well("map office -o whole");
  fails("localize m office --poses tilted.txt", {"m"});
  for (const std::string poses : {"session.txt", "tilted.txt --no-up"}) {
    const json found = json_of("localize m office --json --poses " + poses);
    ASSERT_EQ(found.size(), places.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      EXPECT_NEAR(found[i].at("position")[0], places[i], 0.02) << i;
  }
  EXPECT_THAT(run_well("map office -o m --resume m --locate --poses session.txt --skip 12").out,
              says("located"));
  EXPECT_EQ(info("m").at("scans"), 24);
  for (const char* end : {"min", "max"})
    for (const int axis : {0, 1, 2})
      EXPECT_NEAR(info("m").at("extent").at(end)[axis], info("whole").at("extent").at(end)[axis], 0.05);
  write_floor();
  fails("map floor -o m --resume m --locate", {"m"});
  wrong_use("map floor -o n --locate", {"--locate"});
}

TEST_F(MapRun, LocalizeFindsWhatTheMapFixes) {
  write_floor();
  run_well("map floor -o m");
  // The camera 4 cm too high; along the floor nothing tells where it is.
  write_floor("high", 6, 0.04);
  const json found = json_of("localize m high --guess --json --write-poses found.txt");
  ASSERT_EQ(found.size(), 6U);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].at("outcome"), "corrected");
    EXPECT_EQ(found[i].at("determined"), 3);
    EXPECT_NEAR(found[i].at("position")[0], 0.1 * static_cast<double>(i), 0.002);
    EXPECT_NEAR(found[i].at("position")[2], 1 + floor_height, 0.005);
  }
  const std::string lines = read("found.txt");
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 7) << "a heading, and a line a scan";
  EXPECT_THAT(run_well("localize m high --guess").out, says("3 of 6 directions"));
  wrong_use("localize m high --write-poses found.txt", {"found.txt"});
  fails("localize nothing high", {"nothing"});
  fs::rename(folder / "floor", folder / "fl\xF6r");  // no UTF-8
  EXPECT_THAT(json_of("localize m fl\xF6r --guess --json").at(5).at("name").get<std::string>(),
              says("fl\xEF\xBF\xBDr"));
}

TEST_F(MapRun, InRealTimeScansArriveAtTheirStamps) {
  write_floor("floor", 4);
  write_times("floor", 4, 10);
  run_well("map floor -o m --realtime --detection-budget 0 --report r.json");
  const json report = read_json("r.json");
  EXPECT_EQ(report.at("scans"), 4);
  EXPECT_GE(report.at("wall_s"), 0.3);  // the last one's stamp
  EXPECT_LT(report.at("detection_lag_s").at("p50"), report.at("wall_s"));
  run_well("map floor -o fast");
  EXPECT_TRUE(same_maps("m", "fast"));
  // The budget of real time is no choice of the user's, and does not conflict with a map made without it.
  run_well("map floor -o paper --detector paper");
  run_well("map floor --resume paper --detector paper --realtime");
}

TEST_F(MapRun, OctreesGiveSurfaces) {
  write_slab("slab.bt");
  run_well("map slab.bt -o m --report r.json");
  const json contents = info("m");
  EXPECT_EQ(contents.at("resolution"), 0.05);
  EXPECT_EQ(contents.at("parameters").at("max_hole_size"), 0.2);
  EXPECT_EQ(contents.at("scans"), 0);
  EXPECT_EQ(contents.at("points"), 400);
  ASSERT_EQ(contents.at("surfaces"), 1);
  const json floor = contents.at("largest").at(0);
  EXPECT_EQ(floor.at("inliers"), 400);
  EXPECT_NEAR(floor.at("normal").at(2), 1, 1e-6);      // the side that is free
  EXPECT_NEAR(floor.at("offset"), 0.025, 0.05 / 256);  // the voxels' centres
  EXPECT_NEAR(floor.at("area_m2"), 0.9025, 1e-6);      // (1 m − d)²: from centre to centre
  EXPECT_TRUE(read_json("r.json").at("points_per_second").is_null());
  wrong_use("map slab.bt -o n --resolution 0.02", {"resolution", "0.05"});
  wrong_use("map slab.bt slab.bt -o n", {"slab.bt"});
}

TEST_F(MapRun, AnEditedOctreeIsTakenOverOrKept) {
  write_slab("slab.bt");
  write_slab("wider.bt", 30);
  run_well("map slab.bt -o m");
  const json id = info("m").at("largest").at(0).at("id");
  run_well("map wider.bt --resume m -o n");
  const json after = info("n").at("largest").at(0);
  EXPECT_EQ(after.at("id"), id);
  EXPECT_EQ(after.at("inliers"), 600);
  EXPECT_NEAR(after.at("area_m2"), 1.45 * 0.95, 1e-6);

  // Another tool has written over the map's own.
  write("m.bt", read("wider.bt"));
  EXPECT_THAT(run("map slab.bt --resume m").err, says("map m.edited.bt --resume m "));
  EXPECT_TRUE(read("m.edited.bt") == read("wider.bt"));
  EXPECT_EQ(info("m").at("points"), 400);
  write("m.bt", read("wider.bt"));
  EXPECT_THAT(run_well("map m.bt --resume m").errors, ElementsAre(HasSubstr("kept as m.edited.bt")));
  EXPECT_EQ(info("m").at("largest").at(0).at("id"), id);
  EXPECT_EQ(info("m").at("points"), 600);
  EXPECT_FALSE(exists("m.edited-2.bt"));
  wrong_use("map slab.bt wider.bt --resume m", {"wider.bt"});
  octomap::OcTree(0.04).writeBinary((folder / "fine.bt").string());
  fails("map fine.bt --resume m", {"voxels of 0.04"});
}

TEST_F(MapRun, APillarIsTold) {
  std::ostringstream rows;  // radius 0.2 m about (1.5, 0), a metre high, as seen from the origin
  for (int z = 0; z < 110; ++z)
    for (int a = 0; a < 60; ++a) {
      const double angle = std::numbers::pi * (0.6 + 0.8 * a / 60);
      rows << 1.5 + 0.2 * std::cos(angle) << ' ' << 0.2 * std::sin(angle) << ' ' << -0.5 + z / 110.0 << '\n';
    }
  write_pcd("scan.pcd", rows.str());
  run_well("map scan.pcd -o m --resolution 0.02 --report r.json");
  EXPECT_EQ(read_json("r.json").at("cylinders"), 1);
  const json pillar = info("m").at("cylinders").at(0);
  EXPECT_NEAR(pillar.at("radius_m"), 0.2, 0.003);
  EXPECT_NEAR(pillar.at("length_m"), 109 / 110.0, 0.02);
  EXPECT_NEAR(pillar.at("span_deg"), 180 * 0.8 * 59 / 60, 10);
  EXPECT_NEAR(pillar.at("axis").at(2), 1, 1e-4);
  EXPECT_THAT(run_well("info m").out, says("\ncylinders 1\n"));
  run_well("export m --to m.json");
  EXPECT_EQ(read_json("m.json").at("cylinders").at(0).at("inliers"), pillar.at("inliers"));
  run_well("map scan.pcd -o n --detect-cylinders false");
  EXPECT_TRUE(info("n").at("cylinders").empty());
}

TEST_F(MapRun, DroppedPointsAreCountedWithTheReason) {
  std::string rows;
  for (int i = 0; i < 100; ++i) rows += std::to_string(1 + 0.01 * i) + " 1 1\n";
  rows += "nan nan nan\n0.05 0 0\n0 0.05 0\n2000 0 0\n-2000 0 0\n0 0 3000\n";
  write_pcd("scan.pcd", rows);
  EXPECT_THAT(
      run_well("map scan.pcd -o m --min-range 0.1 --report r.json").out,
      says("1 points: not finite", "2 points: nearer than min_range", "3 points: outside the octree"));
  const json report = read_json("r.json");
  EXPECT_EQ(report.at("points_dropped"), json({{"not_finite", 1}, {"too_near", 2}, {"out_of_map", 3}}));
  EXPECT_EQ(report.at("points_raw"), 106);
}

class Units : public CommandTest {
 protected:
  /// Depth images, seen from one place, whose rows are `nearest` millimetres away and farther, by `step`.
  void write_ramp(const std::string& name, int nearest, int step,
                  const std::string& intrinsics = "60 60 39.5 29.5\n") const {
    write_depths(name + "/0.pgm", 80, 60, [&](int u, int v) { return nearest + step * v + step * u / 7; });
    write(name + "/poses.txt", "0 0 0 0 0 0 1\n");
    write(name + "/intrinsics.txt", intrinsics);
  }

  /// A spinning lidar's cloud of a hall of 12 × 8 × 3 m, in units to the metre.
  void write_hall(const std::string& name, double units, int columns = 512) const {
    std::vector<Eigen::Vector3f> points;
    for (int row = 0; row < 32; ++row)
      for (int column = 0; column < columns; ++column) {
        const double elevation = (row - 15.5) * 2.5 * std::numbers::pi / 180;
        const double azimuth = (column + 0.5) * 2 * std::numbers::pi / columns;
        const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
        const Eigen::Vector3d side(6, 4, ray.z() > 0 ? 2 : 1);
        const double range = (side.array() / ray.array().abs()).minCoeff();
        points.push_back((units * range * ray).cast<float>());
      }
    std::string text = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
                       std::to_string(columns) + "\nHEIGHT 32\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
                       std::to_string(32 * columns) + "\nDATA binary\n";
    text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof points[0]);
    write(name, text);
  }
};

TEST_F(Units, ALimitThatNobodyStatedAndCutsMuchIsToldOrRefused) {
  write_ramp("far", 4010, 20);
  fails("map far -o far", {"mapped, all", "--depth-scale", "--max-range", "nothing is written"});
  EXPECT_FALSE(exists("far.surfaces"));
  run_well("map far -o far --max-range 20");
  EXPECT_TRUE(exists("far.surfaces"));
  write_ramp("half", 3000, 35);
  EXPECT_THAT(run("map half -o half").out, says("only freed space: beyond max_range"));
}

TEST_F(Units, AnOrganisedLidarIsMappedAsFarAsItReaches) {
  write_hall("hall.pcd", 1);
  const std::string lidar = run_well("map hall.pcd -o hall --resolution 0.1 --viewpoint 0 0 0").out;
  EXPECT_THAT(lidar, Not(HasSubstr("only freed space")));
  EXPECT_THAT(run("map hall.pcd -o camera --resolution 0.1 --sensor camera").out, says("only freed space"));
}

TEST_F(Units, ACloudInMillimetresOrCentimetresIsRefused) {
  for (const int units : {100, 1000}) {
    write_hall("hall.pcd", units);
    fails("map hall.pcd -o refused --resolution 0.1", {"as if not in metres", "--depth-scale 1000"});
    run_well("map hall.pcd -o hall --resolution 0.1 --force --depth-scale " + std::to_string(units));
  }
  write_hall("hall.pcd", 20, 64);  // 19 of 20 readings within 120 m
  run_well("map hall.pcd -o large --resolution 1 --force");
}

TEST_F(Units, IntrinsicsOfImagesOfAnotherSizeAreRefused) {
  write_ramp("near", 1000, 20, "525 525 319.5 239.5\n");
  fails("map near -o near", {"images of about 640x480 pixels, not of 80x60", "times 0.125"});
  write_ramp("small", 1000, 20, "30 30 19.5 14.5\n");  // of 40x30
  fails("map small -o small", {"images of about 40x30 pixels"});
  write_ramp("outside", 1000, 20, "60 60 100 29.5\n");
  fails("map outside -o outside", {"principal point"});
  write_ramp("part", 1000, 20, "60 60 60 29.5\n");  // an image's part, cut at the left
  run_well("map part -o part");
}

class PoseCheck : public CommandTest {
 protected:
  /// Of the simulated room, with each of its poses changed.
  void write_room(const std::string& name, const Change& change) const {
    simulate_room();
    fs::copy(folder / "room", folder / name);
    change_poses(name, change);
  }
};

const Eigen::Matrix4d turned = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();

/// Axes of a body's frame (x forward, z up) in that of a camera (x right, y down, z forward), or the other
/// way.
Eigen::Matrix4d camera_in_body() {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return T;
}

TEST_F(PoseCheck, PosesInAnotherFormAreToldAndTakenOnDemand) {
  simulate_room();
  run_well("map room -o right --resolution 0.1");
  const double area = info("right")["area_m2"].get<double>();
  const std::vector<std::pair<std::string, std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>>> forms{
      {"inverse", [](const Eigen::Matrix4d& T) { return T.inverse().eval(); }},
      {"w-first",
       [](const Eigen::Matrix4d& T) {  // as if w x y z were x y z w
         const Eigen::Quaterniond q(Eigen::Matrix3d(T.topLeftCorner<3, 3>()));
         Eigen::Matrix4d read = T;
         read.topLeftCorner<3, 3>() = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
         return read;
       }},
      {"opengl", [](const Eigen::Matrix4d& T) { return (T * turned).eval(); }},
      {"opengl-inverse", [](const Eigen::Matrix4d& T) { return (T * turned).inverse().eval(); }},
      {"of-body", [](const Eigen::Matrix4d& T) { return (T * camera_in_body().inverse()).eval(); }}};
  for (const auto& [name, change] : forms) {
    write_room(name, [change = change](const Eigen::Matrix4d& T, int) { return change(T); });
    const std::string map = "map " + name + " --resolution 0.1 -o ";
    EXPECT_THAT(run_well(map + "wrong --force --align off").err, HasSubstr("scans contradict each other"))
        << name;
    EXPECT_THAT(run_well(map + "maps/" + name + " --pose-form " + name).err, Not(HasSubstr("contradict")));
    EXPECT_THAT(run_well("check " + name + " --resolution 0.1").out, HasSubstr("--pose-form " + name));
    EXPECT_NEAR(info("maps/" + name)["area_m2"], area, 0.02 * area) << name;
  }
}

/// Their poses say where they were seen from.
TEST_F(PoseCheck, CloudsInTheMapsFrameAreTold) {
  run_well("simulate room -o room --sensor spinning --frames 8");
  const auto source = open_scans({folder / "room"});
  for (int i = 0; const std::optional<Scan> scan = source->next(); ++i) {
    std::string rows;
    for (const Eigen::Vector3f& point : scan->points) {
      const Eigen::Vector3d p = scan->T_map_sensor * point.cast<double>();
      if (p.allFinite())
        rows += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    }
    write_pcd("placed/" + std::to_string(i) + ".pcd", rows);
  }
  write("placed/poses.txt", read("room/poses.txt"));
  const std::string of = " --resolution 0.1 ";
  EXPECT_THAT(run_well("map placed -o m --align off" + of).err, HasSubstr("scans contradict each other"));
  EXPECT_THAT(run_well("check placed" + of).out,
              says("lie in the map's frame already", "--pose-form in-map"));
  EXPECT_THAT(run_well("map placed -o m --force --pose-form in-map" + of).err, Not(HasSubstr("contradict")));
  run_well("map room -o right" + of);
  const double area = info("right")["area_m2"].get<double>();
  EXPECT_NEAR(info("m")["area_m2"], area, 0.01 * area);
}

}  // namespace
}  // namespace octosurf::test
