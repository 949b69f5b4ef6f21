// `octosurf query` about places: boxes, spheres, rays, voxels.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class PlaceQuery : public CommandTest {
 protected:
  PlaceQuery() {
    write_floor();
    run_well("map floor --poses floor/poses.txt -o map");
  }
  json told(const std::string& question) const {
    return json::parse(run_well("query map --json " + question).out);
  }
};

TEST_F(PlaceQuery, SurfacesInABoxAndInASphere) {
  const json inside = told("--box 0 0 0.1 0.2 0.2 -0.1").at("surfaces");
  ASSERT_EQ(inside.size(), 1U);
  EXPECT_TRUE(told("--box 0 0 0.1 0.2 0.2 0.3").at("surfaces").empty());
  EXPECT_EQ(told("--sphere 0.1 0.1 0.5 0.6").at("surfaces"), inside);
  EXPECT_TRUE(told("--sphere 0.1 0.1 0.5 0.4").at("surfaces").empty());
  EXPECT_THAT(run_well("query map --box 0 0 0.1 0.2 0.2 -0.1").out, HasSubstr("area m²"));
}

TEST_F(PlaceQuery, TheFirstSurfaceOnARay) {
  const json hit = told("--ray 0.1 0.1 1 0 0 -2");
  EXPECT_NEAR(hit.at("distance_m").get<double>(), 1 - floor_height, 0.005);
  EXPECT_NEAR(hit.at("point").at(2).get<double>(), floor_height, 0.005);
  EXPECT_EQ(hit.at("side"), "front");
  EXPECT_EQ(told("--ray 0.1 0.1 -1 0 0 1").at("side"), "back");
  EXPECT_TRUE(told("--ray 0.1 0.1 1 0 0 1").at("surface").is_null());
}

TEST_F(PlaceQuery, AVoxel) {
  const json floor = told("--voxel 0.1 0.1 " + std::to_string(floor_height));
  EXPECT_EQ(floor.at("state"), "occupied");
  EXPECT_EQ(floor.at("surface"), told("--sphere 0.1 0.1 0 0.1").at("surfaces").at(0));
  const json air = told("--voxel 0.1 0.1 0.5");
  EXPECT_EQ(air.at("state"), "free");
  EXPECT_LT(air.at("log_odds").get<double>(), 0);
  EXPECT_EQ(told("--voxel 0.1 0.1 -0.5").at("state"), "unknown");
}

}  // namespace
}  // namespace octosurf::test
