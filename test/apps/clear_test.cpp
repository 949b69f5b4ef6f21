// `octosurf clear` on a map of a floor.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

TEST_F(FloorTest, ClearTakesBackWhatIsInside) {
  const double whole = ask("--nearest 0 0 0.5").at("area_m2").get<double>();
  EXPECT_THAT(error_of("clear m --box -2 -2 -1 0.2 2 1", 2), HasSubstr("--force"));
  EXPECT_THAT(run_well("clear m --box 0.2 2 1 -2 -2 -1 -o n").out,
              HasSubstr("0 surfaces gone, 1 smaller, 1 left"));
  const auto left = json_of("query n --json --nearest 0.4 0 0.5");
  EXPECT_LT(left.at("area_m2").get<double>(), 0.8 * whole);
  EXPECT_EQ(json_of("query n --json --voxel 0.1 0.1 " + std::to_string(floor_height)).at("state"), "unknown");
  EXPECT_EQ(ask("--nearest 0 0 0.5").at("area_m2").get<double>(), whole);  // the old files are as they were
  run_well("clear m --cylinder 0 0 -1 9 2 --free --force");
  EXPECT_EQ(ask("--voxel 0.1 0.1 " + std::to_string(floor_height)).at("state"), "free");
  EXPECT_EQ(run("clear n").code, 2);
  EXPECT_THAT(error_of("clear n --box 0 0 0 0 1 1 --force", 2), HasSubstr("--box: is empty"));
  EXPECT_THAT(error_of("clear n --cylinder 0 0 0 0 1 --force", 2), HasSubstr("--cylinder: is empty"));
  const std::string before = read("n.surfaces");
  EXPECT_THAT(error_of("clear n --box 50 50 0 51 51 1 --force", 1), HasSubstr("nothing is known"));
  EXPECT_THAT(error_of("clear n --box 50 50 0 51 51 1 --free -o o", 1), HasSubstr("nothing is written"));
  EXPECT_EQ(read("n.surfaces"), before);
  EXPECT_FALSE(exists("o.surfaces") || exists("o.lock"));
  write("n.bt", read("m.bt"));  // as another tool may do
  EXPECT_THAT(run_well("clear n --cylinder 0.4 0 -1 0.1 2 --force").err, HasSubstr("kept as n.edited.bt"));
  EXPECT_EQ(read("n.edited.bt"), read("m.bt"));
  // What is there comes back by other scans; those that are in the map are not mapped again.
  write_floor("again", 6, 0.0005);
  run_well("map again --resume n -o n --force");
  EXPECT_NEAR(json_of("query n --json --nearest 0.4 0 0.5").at("area_m2").get<double>(), whole, 0.02 * whole);
}

}  // namespace
}  // namespace octosurf::test
