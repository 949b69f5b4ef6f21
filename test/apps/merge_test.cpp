// `octosurf merge` on maps of the two halves of a room, and `octosurf diff` of one from which a table went.
#include "apps/command.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"
#include "support/unshared_area.hpp"

#include <cmath>
#include <sstream>
#include <utility>

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

Parameters of_4_cm() {
  Parameters coarse;
  coarse.occupancy.resolution = 0.04;
  return coarse;
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
    Mapper left(of_4_cm()), right(of_4_cm()), all(of_4_cm()), elsewhere(of_4_cm());
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
    Mapper mapper(of_4_cm()), other(of_4_cm());
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
