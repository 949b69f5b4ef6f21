// `octosurf export --format`: planners' own formats from the shell. What is in the files test/io/ checks.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class PlannerExportVerb : public CommandTest {
 protected:
  PlannerExportVerb() {
    write_floor();
    run_well("map floor -o m --align off");
  }

  /// Area that the pieces of a file cover, seen from above.
  double area_of(const std::string& file) const {
    double twice = 0;
    for (const json& piece : read_json(file)) {
      const json& v = piece.at("vertices");
      for (std::size_t i = 0; i < v.size(); ++i) {
        const json &a = v[i], &b = v[(i + 1) % v.size()];
        twice += a[0].get<double>() * b[1].get<double>() - a[1].get<double>() * b[0].get<double>();
      }
    }
    return twice / 2;
  }
};

// Of the floor, 79/60 + 0.5 by 59/60 m, a foot leaves the inset.
constexpr double length = 79.0 / 60 + 0.5, width = 59.0 / 60;

TEST_F(PlannerExportVerb, Sl1mIsInsetByTheFoot) {
  run_well("export m --to disc.json --format sl1m --foot-radius 0.1");
  EXPECT_NEAR(area_of("disc.json"), (length - 0.2) * (width - 0.2), 0.05);
  run_well("export m --to sole.json --format sl1m --foot 0.4x0.2 --yaw 0 --pieces 40");
  EXPECT_NEAR(area_of("sole.json"), (length - 0.4) * (width - 0.2), 0.05);
  run_well("export m --to across.json --format sl1m --foot 0.4x0.2 --yaw 90 --pieces 40");
  EXPECT_NEAR(area_of("across.json"), (length - 0.2) * (width - 0.4), 0.05);
  run_well("export m --to one.json --format sl1m --pieces 1");
  EXPECT_EQ(read_json("one.json").size(), 1u);
}

TEST_F(PlannerExportVerb, ClearanceIsAskedOfTheOctree) {
  // Nothing hangs over the floor: what is free over it stays, whatever is asked for.
  run_well("export m --to any.json --format sl1m --pieces 40");
  run_well("export m --to tall.json --format sl1m --pieces 40 --clearance 0.5");
  EXPECT_NEAR(area_of("tall.json"), area_of("any.json"), 1e-6);
}

TEST_F(PlannerExportVerb, EveryFormatIsWritten) {
  run_well("export m --to terrain.json --format planar_terrain --frame odom");
  const json terrain = read_json("terrain.json");
  EXPECT_EQ(terrain.at("planarRegions").size(), 1u);
  EXPECT_EQ(terrain.at("gridmap").at("info").at("header").at("frame_id"), "odom");
  run_well("export m --to terrain.cdr --format planar_terrain");
  EXPECT_EQ(read("terrain.cdr").substr(0, 4), std::string("\0\1\0\0", 4));
  EXPECT_THAT(run_well("export m --to grid.json --format grid_map --cell 0.1").out,
              HasSubstr("cells of 0.1 m"));
  EXPECT_EQ(read_json("grid.json").at("info").at("resolution"), 0.1);
  run_well("export m --to heights.png --format height");
  EXPECT_EQ(read_json("heights.json").at("image"), "heights.png");
}

TEST_F(PlannerExportVerb, EndingsDecideAsEverWithoutAFormat) {
  run_well("export m --to m.json");
  EXPECT_EQ(read_json("m.json").at("format"), "octosurf-surfaces");
}

TEST_F(PlannerExportVerb, WhereUpIsGivenEverythingIsTurned) {
  // Up is said to be +x, which makes the floor a wall.
  EXPECT_THAT(run_well("export m --to wall.json --format sl1m --up x --max-slope 180").out,
              HasSubstr("turned so that up is +z"));
  EXPECT_NEAR(read_json("wall.json")[0].at("normal")[2], 0, 0.01);
  EXPECT_THAT(error_of("export m --to p.json --format sl1m --up x", 1), HasSubstr("no surface has room"));
  EXPECT_THAT(run_well("export m --to up.json --format sl1m").out, ::testing::Not(HasSubstr("turned")));
}

TEST_F(PlannerExportVerb, WhatIsThereStays) {
  run_well("export m --to p.json --format sl1m");
  EXPECT_THAT(error_of("export m --to p.json --format sl1m", 2), HasSubstr("--force"));
}

}  // namespace
}  // namespace octosurf::test
