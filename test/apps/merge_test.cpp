// `octosurf merge` on maps of the two halves of a room.
#include "apps/command.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"
#include "support/unshared_area.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <sstream>
#include <utility>

#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

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
    Mapper left(parameters()), right(parameters()), all(parameters()), elsewhere(parameters());
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
  static Parameters parameters() {
    Parameters coarse;
    coarse.occupancy.resolution = 0.04;
    return coarse;
  }
  double apart_m2(const std::string& a, const std::string& b) const {
    const LoadedMap one = load_map(folder / a), other = load_map(folder / b);
    return unshared_area(*one.map.snapshot(), *other.map.snapshot()) +
           unshared_area(*other.map.snapshot(), *one.map.snapshot());
  }
};

TEST_F(Merge, MakesOneMapOfTwo) {
  const std::string left = read("left.surfaces");
  const std::string printed = run_well("merge left right -o both").out;
  EXPECT_THAT(printed, HasSubstr("first"));
  EXPECT_THAT(printed, HasSubstr("written      both.surfaces, both.bt"));
  const json both = info("both");
  EXPECT_EQ(both.at("scans"), 12);
  EXPECT_LT(apart_m2("both", "all"), 0.8) << "of some 20 m²";
  const std::string surfaces = both.at("surfaces").dump() + " surfaces, ";
  EXPECT_THAT(printed, HasSubstr("merged       " + surfaces));
  EXPECT_THAT(printed, HasSubstr("of the second's " + info("right").at("surfaces").dump() + " surfaces go on"));
  EXPECT_EQ(read("left.surfaces"), left);
  EXPECT_TRUE(exists("both.bt"));
}

TEST_F(Merge, WritesOverWithForceOnly) {
  const std::string left = read("left.surfaces");
  EXPECT_THAT(error_of("merge left right -o left", 2), HasSubstr("--force"));
  EXPECT_EQ(read("left.surfaces"), left);
  run_well("merge left right -o left --force");
  EXPECT_EQ(info("left").at("scans"), 12);
  EXPECT_THAT(error_of("merge left right", 2), HasSubstr("--output"));
  EXPECT_THAT(error_of("merge right right -o twice", 2), HasSubstr("given twice"));
  EXPECT_THAT(error_of("merge right ./right.surfaces -o twice", 2), HasSubstr("given twice"));
  EXPECT_THAT(error_of("merge left right all -o both", 2), HasSubstr("all"));
  EXPECT_THAT(error_of("merge left nothing -o both", 1), HasSubstr("nothing"));
}

TEST_F(Merge, TakesThePoseOfTheSecondFrame) {
  run_well("merge left right_elsewhere -o both --pose 0 1 0 0 0 90");
  EXPECT_LT(apart_m2("both", "all"), 1.2);
  EXPECT_EQ(run("merge left right -o none --pose 0 1 0").code, 2);
  EXPECT_FALSE(exists("none.surfaces"));
}

TEST_F(Merge, FindsThePoseFromAGuess) {
  const std::string printed =
      run_well("merge left right_elsewhere -o both --pose 0.1 1.05 -0.04 1 -1 92 --align").out;
  EXPECT_THAT(printed, HasSubstr("6 of 6 directions fixed"));
  std::istringstream pose(printed.substr(printed.find("--pose ") + 7));
  constexpr double within = 0.005, within_deg = 0.28;  // m; of 5 mm at a metre
  for (const auto& [truth, most] :
       {std::pair(0, within), {1, within}, {0, within}, {0, within_deg}, {0, within_deg}, {90, within_deg}}) {
    double found = NAN;
    pose >> found;
    EXPECT_NEAR(found, truth, most);
  }
  EXPECT_LT(apart_m2("both", "all"), 1.2);
  EXPECT_THAT(error_of("merge left right_elsewhere -o none --pose 30 0 0 0 0 0 --align", 1),
              HasSubstr("--pose"));
  EXPECT_FALSE(exists("none.surfaces"));
}

TEST_F(Merge, RefusesMapsThatDoNotFit) {
  const std::string merge = "merge left right_elsewhere -o both --pose 0.1 1.05 -0.04 1 -1 92";
  EXPECT_THAT(error_of(merge, 1), AllOf(HasSubstr("where its surfaces meet"), HasSubstr("--align")));
  EXPECT_FALSE(exists("both.surfaces"));
  run_well(merge + " --anyway");
}

/// Two maps of other places, each about its own 0, and two that lie apart.
TEST_F(Merge, RefusesMapsThatShareNoPlace) {
  write_floor();
  run_well("map floor -o floor --resolution 0.04");
  EXPECT_THAT(error_of("merge left floor -o both --pose 0 0 30 0 0 0", 1),
              AllOf(HasSubstr("no place in common with left"), HasSubstr("--anyway")));
  EXPECT_THAT(error_of("merge left floor -o both --pose 0 0 0.8 90 0 0", 1), HasSubstr("does not fit left"));
  EXPECT_FALSE(exists("both.surfaces") || exists("both.lock"));
  run_well("merge left floor -o both --pose 0 0 30 0 0 0 --anyway");
}

TEST_F(Merge, RefusesScansThatBothHold) {
  write_floor();
  const std::string floor = "map floor --poses floor/poses.txt --intrinsics floor/intrinsics.txt -o ";
  run_well(floor + "one --first 4");
  run_well(floor + "two --skip 3");
  EXPECT_THAT(error_of("merge one two -o both", 1), HasSubstr("holds 1 scan of one"));
  run_well("merge one two -o both --anyway");
  EXPECT_EQ(info("both").at("scans"), 7);
}

TEST_F(Merge, RefusesAnotherResolution) {
  Parameters coarse;
  coarse.occupancy.resolution = 0.05;
  save_map(Map(coarse), folder / "coarse");
  EXPECT_THAT(error_of("merge left coarse -o both", 1), HasSubstr("resolution is 0.05"));
  EXPECT_FALSE(exists("both.surfaces"));
}

TEST_F(Merge, RefusesOtherParametersAndNamesBoth) {
  Parameters other = parameters();
  other.occupancy.hit = 0.8;
  save_map(Map(other), folder / "other");
  EXPECT_THAT(error_of("merge left other -o both", 1),
              AllOf(HasSubstr("its hit is 0.8"), HasSubstr("left is 0.7")));
  EXPECT_FALSE(exists("both.surfaces"));
  run_well("merge left other -o both --anyway");
}

/// Merged one after the other or as a tree, parts give the surfaces of one run.
TEST_F(Merge, OfPartsGivesTheSurfacesOfOneRun) {
  constexpr int images = 20, parts = 6;
  write_floor("floor", images);
  run_well("map floor -o one");
  for (int k = 1; k <= parts; ++k)
    run_well("map floor -o p" + std::to_string(k) + " --subset " + std::to_string(k) + "/" +
             std::to_string(parts));
  run_well("merge p1 p2 -o whole");
  for (int k = 3; k <= parts; ++k) run_well("merge whole p" + std::to_string(k) + " -o whole --force");
  EXPECT_EQ(info("whole").at("scans"), images);
  // The camera sees 79/60 × 59/60 m and moves on by 0.1 m: area of all images together.
  constexpr double area = (79.0 / 60 + 0.1 * (images - 1)) * 59 / 60;
  EXPECT_LT(apart_m2("whole", "one"), 0.01 * 2 * area);
  run_well("merge p4 p5 -o p45");
  run_well("merge p6 p45 -o half");
  run_well("merge p1 p2 -o p12");
  run_well("merge p12 p3 -o other_half");
  run_well("merge half other_half -o tree");
  EXPECT_EQ(info("tree").at("scans"), images);
  EXPECT_LT(apart_m2("tree", "whole"), 0.01 * 2 * area);
}

TEST_F(Merge, RefusesMapsOfTheSameScans) {
  write_floor();
  run_well(
      "map floor --poses floor/poses.txt --intrinsics floor/intrinsics.txt -o kept --keep-scans kept.scans");
  std::filesystem::copy(folder / "kept.surfaces", folder / "too.surfaces");
  std::filesystem::copy(folder / "kept.bt", folder / "too.bt");
  EXPECT_THAT(error_of("merge kept too -o both", 1), HasSubstr("count twice"));
  EXPECT_FALSE(exists("both.surfaces"));
}

TEST_F(Merge, CanBeGoneOnWith) {
  run_well("merge left right -o both");
  write_floor();
  run_well("map floor --poses floor/poses.txt --intrinsics floor/intrinsics.txt --resume both -o both");
  EXPECT_EQ(info("both").at("scans"), 18);
}

}  // namespace
}  // namespace octosurf::test
