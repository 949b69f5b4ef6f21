// `octosurf merge` on maps of the two halves of a room.
#include "apps/command.hpp"
#include "support/scene.hpp"
#include "support/seed.hpp"
#include "support/unshared_area.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gmock/gmock.h>

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
  const std::string told = run_well("merge left right -o both --report both.json").out;
  EXPECT_THAT(told, HasSubstr("first"));
  EXPECT_THAT(told, HasSubstr("written      both.surfaces, both.bt, both.json"));
  const json both = info("both");
  EXPECT_EQ(both.at("scans"), 12);
  EXPECT_LT(apart_m2("both", "all"), 0.8) << "of some 20 m²";
  const json report = read_json("both.json");
  EXPECT_EQ(report.at("merged").at("surfaces"), both.at("surfaces"));
  EXPECT_EQ(report.at("second").at("surfaces"), report.at("surfaces").size());
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
  EXPECT_THAT(error_of("merge left right -o both --report left.surfaces --force", 2), HasSubstr("--report"));
  EXPECT_THAT(error_of("merge left nothing -o both", 1), HasSubstr("nothing"));
}

TEST_F(Merge, TakesThePoseOfTheSecondFrame) {
  run_well("merge left right_elsewhere -o both --pose 0 1 0 0 0 90");
  EXPECT_LT(apart_m2("both", "all"), 1.2);
  write("T.txt", "0 -1 0 0  1 0 0 1  0 0 1 0  0 0 0 1\n");
  run_well("merge left right_elsewhere -o by_file --pose-file T.txt");
  EXPECT_LT(apart_m2("both", "by_file"), 0.05);
  write("two.txt", "0 0 0 0 0 0 1\n0 0 0 0 0 0 1\n");
  EXPECT_THAT(error_of("merge left right -o none --pose-file two.txt", 1), HasSubstr("2 poses"));
  EXPECT_EQ(run("merge left right -o none --pose 0 1 0").code, 2);
  EXPECT_EQ(run("merge left right -o none --pose 0 1 0 0 0 0 --pose-file T.txt").code, 2);
  EXPECT_FALSE(exists("none.surfaces"));
}

TEST_F(Merge, FindsThePoseFromAGuess) {
  const std::string told =
      run_well("merge left right_elsewhere -o both --pose 0.1 1.05 -0.04 1 -1 92 --align --report both.json")
          .out;
  EXPECT_THAT(told, HasSubstr("6 of 6 directions fixed"));
  const json T = read_json("both.json").at("T_first_second");
  const std::array<double, 16> truth{0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1};
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_NEAR(T[i], truth[i], 0.005) << i;
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

/// Every order of the parts gives the same bytes; a tree of them gives the surfaces of one run, too.
TEST_F(Merge, OfManyDoesNotDependOnTheirOrder) {
  constexpr int images = 20, parts = 10;
  write_floor("floor", images);
  const std::string floor = "map floor --poses floor/poses.txt --intrinsics floor/intrinsics.txt -o ";
  run_well(floor + "one");
  std::vector<std::string> names;
  for (int k = 1; k <= parts; ++k) {
    names.push_back("p" + std::to_string(k));
    run_well(floor + names.back() + " --subset " + std::to_string(k) + "/" + std::to_string(parts));
    EXPECT_EQ(info(names.back()).at("scans"), images / parts);
  }
  std::string first;
  std::mt19937_64 random = rng();
  for (int order = 0; order < 3; ++order) {
    std::string line;
    for (const std::string& name : names) line += " " + name;
    run_well("merge" + line + " -o all --force");
    if (order == 0) first = read("all.surfaces");
    EXPECT_EQ(read("all.surfaces"), first) << line;
    std::shuffle(names.begin(), names.end(), random);
  }
  EXPECT_EQ(info("all").at("scans"), images);
  // The camera sees 79/60 × 59/60 m and moves on by 0.1 m: area of all images together.
  constexpr double area = (79.0 / 60 + 0.1 * (images - 1)) * 59 / 60;
  EXPECT_LT(apart_m2("all", "one"), 0.01 * 2 * area);
  // Two groups, whichever parts they got by the last shuffle.
  std::string groups[2];
  for (std::size_t k = 0; k < names.size(); ++k) groups[k % 2] += " " + names[k];
  run_well("merge" + groups[0] + " -o half0");
  run_well("merge" + groups[1] + " -o half1");
  run_well("merge half0 half1 -o tree");
  EXPECT_LT(apart_m2("tree", "all"), 0.01 * 2 * area);
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
