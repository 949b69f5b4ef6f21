// A recording whose poses jump for good, as where a loop closes on a map that was bent on the way.
#include "apps/command.hpp"
#include "support/seed.hpp"

#include <cstdio>
#include <gmock/gmock.h>
#include <sstream>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class Closures : public CommandTest {
 protected:
  static constexpr int frames = 30, first_moved = 20;
  static std::string frame(int i) {
    char name[32];
    std::snprintf(name, sizeof name, "room/frame-%06d", i);
    return name;
  }
  /// A room; the poses of `from` to `to` are 8 cm off along x.
  void move_poses(int from, int to) const {
    const std::string world = std::to_string(seed());
    made_once("room to close" + world, [&] {
      run_well("simulate room -o room --frames " + std::to_string(frames) + " --seed " + world);
    });
    for (int i = from; i < to; ++i) {
      std::istringstream in(read(frame(i) + ".pose.txt"));
      std::string out;
      for (int k = 0; k < 16; ++k) {
        double value = 0;
        in >> value;
        out += std::to_string(value + (k == 3 ? 0.08 : 0)) + (k % 4 == 3 ? "\n" : " ");
      }
      write(frame(i) + ".pose.txt", out);
    }
  }
};

TEST_F(Closures, AreToldWithScansAndDistance) {
  move_poses(first_moved, frames);
  // Without a budget, so that walls are known by the time they are seen again.
  const Outcome outcome = run_well("map room -o map --first 26 --report report.json --detection-budget 0");
  EXPECT_THAT(outcome.err, HasSubstr("where the poses do not meet what was mapped before"));
  const json closures = read_json("report.json").at("alignment").at("closures");
  ASSERT_GE(closures.size(), 1U);
  // The first scans may be left out, or moved in part, until what they see tells where they are.
  const std::string first = closures[0].at("first");
  EXPECT_GE(first, frame(first_moved));
  EXPECT_LT(first, frame((first_moved + frames) / 2));
  // Directions that the scan in question does not determine do not count.
  EXPECT_GT(closures[0].at("distance_m").get<double>(), 0.02);
  EXPECT_LT(closures[0].at("distance_m").get<double>(), 0.07);
}

TEST_F(Closures, AreNotSingleJumps) {
  move_poses(first_moved, first_moved + 1);
  const Outcome outcome = run_well("map room -o map --first 26 --report report.json");
  EXPECT_THAT(outcome.err, Not(HasSubstr("do not meet")));
  EXPECT_TRUE(read_json("report.json").at("alignment").at("closures").empty());
}

}  // namespace
}  // namespace octosurf::test
