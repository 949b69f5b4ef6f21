// Bags as users see them; test/io compares their scans with those of their folders, test/peers their maps.
#include "apps/command.hpp"
#include "support/bag_writer.hpp"
#include "support/paths.hpp"

#include <sstream>

namespace octosurf::test {
namespace {

class Bags : public CommandTest {
 protected:
  void SetUp() override {
    if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
  }
  void write_bag(const std::string& recording, const std::string& bag,
                 const std::string& options = {}) const {
    write_bag_of(folder / recording, folder / bag, options);
  }
};

TEST_F(Bags, InfoTellsTopicsCountsAndTimes) {
  simulate_for_bag("sim", "--sensor spinning --frames 3");
  for (const std::string bag : {"walk.bag", "walk.db3", "walk.mcap"}) {
    write_bag("sim", bag);
    EXPECT_THAT(run_well("info " + bag).out,
                says("messages     6\n", "duration     0.200 s\n",
                     "/lidar/points  sensor_msgs/PointCloud2          3     0.000 s     0.200 s"));
    const json contents = json_of("info --json " + bag), topic = contents.at("topics").at(0);
    EXPECT_EQ(contents.at("messages"), 6);
    EXPECT_EQ(contents.at("first_s"), 1.7e9);
    EXPECT_NEAR(contents.at("duration_s"), 0.2, 1e-6);
    EXPECT_EQ(topic.at("name"), "/lidar/points");
    EXPECT_EQ(topic.at("type"), "sensor_msgs/PointCloud2");
    EXPECT_EQ(topic.at("messages"), 3);
    EXPECT_NEAR(topic.at("last_s").get<double>() - topic.at("first_s").get<double>(), 0.2, 1e-6);
  }
  wrong_use("info walk.bag --up z", {"a bag"});
  EXPECT_THAT(run_well("map walk.mcap -o m").out,
              says("walk.mcap: scans: 3 messages of /lidar/points (sensor_msgs/PointCloud2)\n",
                   "walk.mcap: poses: tf of lidar in map"));
  fails("map walk.mcap -o n --topic /camera",
        {"no topic /camera", "/lidar/points (sensor_msgs/PointCloud2)"});
}

/// The commands of docs/usage.md, as they stand there.
TEST_F(Bags, TheDocumentedCommandsRun) {
  simulate_for_bag("sim", "--sensor spinning --frames 1");
  for (const std::string bag : {"walk.bag", "walk.mcap"}) write_bag("sim", bag, "poses=chain");
  simulate_for_bag("depth", "--frames 1");
  write_bag("depth", "kitchen.db3", "poses=odometry");
  fs::create_directory(folder / "maps");
  std::istringstream usage(read(test::paths::source() + "/docs/usage.md"));
  std::string line;
  while (std::getline(usage, line) && line != "## Bags") {
  }
  while (std::getline(usage, line) && line != "```sh") {
  }
  int commands = 0;
  for (; std::getline(usage, line) && line != "```"; ++commands) {
    ASSERT_TRUE(line.starts_with("octosurf ")) << line;
    run_well(line.substr(9, line.find('#') - 9));
  }
  EXPECT_GE(commands, 4);
}

}  // namespace
}  // namespace octosurf::test
