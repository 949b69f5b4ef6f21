// `octosurf export --format`: planners' own formats from the shell. What is in the files test/io/ checks.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class PlannerExportVerb : public FloorTest {
 protected:
  /// Area of the insets of a file's regions, seen from above.
  double area_of(const std::string& file) const {
    double twice = 0;
    const json terrain = read_json(file);
    for (const json& region : terrain.at("planarRegions"))
      for (const json& inset : region.at("insets")) {
        const json& ring = inset.at("outer_boundary").at("points");
        for (std::size_t i = 0; i < ring.size(); ++i) {
          const json &a = ring[i], &b = ring[(i + 1) % ring.size()];
          twice += a.at("x").get<double>() * b.at("y").get<double>() -
                   a.at("y").get<double>() * b.at("x").get<double>();
        }
      }
    return twice / 2;
  }
};

// Of the floor, 79/60 + 0.5 by 59/60 m, a foot leaves the inset, a voxel from its edges.
constexpr double length = 79.0 / 60 + 0.5 - 2 * 0.02, width = 59.0 / 60 - 2 * 0.02;

TEST_F(PlannerExportVerb, RegionsAreInsetByTheFoot) {
  // One camera saw the floor from above, so nobody saw what is over the floor's border.
  const std::string write = "export m --format planar_terrain --unknown free --to ";
  run_well(write + "disc.json --foot-radius 0.1");
  EXPECT_NEAR(area_of("disc.json"), (length - 0.2) * (width - 0.2), 0.05);
  run_well(write + "sole.json --foot 0.4x0.2 --yaw 0");
  EXPECT_NEAR(area_of("sole.json"), (length - 0.4) * (width - 0.2), 0.05);
  run_well(write + "across.json --foot 0.4x0.2 --yaw 90");
  EXPECT_NEAR(area_of("across.json"), (length - 0.2) * (width - 0.4), 0.05);
  run_well("export m --format planar_terrain --to seen.json --foot-radius 0.1");
  EXPECT_LT(area_of("seen.json"), area_of("disc.json") - 0.05);
  // Nothing hangs over the floor: what is free over it stays, whatever the clearance.
  run_well(write + "any.json");
  run_well(write + "tall.json --clearance 0.5");
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
  run_well("export m --to m.json");  // without --format the ending decides
  EXPECT_EQ(read_json("m.json").at("format"), "octosurf-surfaces");
  EXPECT_THAT(error_of("export m --to terrain.json --format grid_map", 2), HasSubstr("--force"));
}

TEST_F(PlannerExportVerb, WhereUpIsGivenEverythingIsTurned) {
  EXPECT_THAT(run_well("export m --to tilted.json --format planar_terrain --up 1 0 2").out,
              HasSubstr("turned so that up is +z"));
  const json turn = read_json("tilted.json").at("planarRegions")[0].at("plane_parameters").at("orientation");
  const double x = turn.at("x"), y = turn.at("y");
  EXPECT_NEAR(1 - 2 * (x * x + y * y), 2 / std::sqrt(5), 0.01);  // z of the normal
  EXPECT_THAT(error_of("export m --to p.json --format planar_terrain --up x", 1), HasSubstr("no surface"));
  EXPECT_THAT(run_well("export m --to up.json --format grid_map").out, ::testing::Not(HasSubstr("turned")));
}

}  // namespace
}  // namespace octosurf::test
