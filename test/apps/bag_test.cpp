// Bags as users map them: the same map as from the folder that they were made of; test/io compares their
// scans.
#include "apps/command.hpp"
#include "support/bag_writer.hpp"
#include "support/paths.hpp"

#include <fstream>
#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

class Bags : public CommandTest {
 protected:
  void SetUp() override {
    if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
  }

  void write_bag(const std::string& recording, const std::string& bag,
                 const std::string& options = {}) const {
    write_bag_of(folder / recording, folder / bag, options);
  }

  /// Maps the bag and compares with the map of its folder.
  void expect_map_of(const std::string& bag, const std::string& expected,
                     const std::string& options = {}) const {
    run_well("map " + bag + " -o bag --force --resolution 0.05 " + options);
    EXPECT_TRUE(read("bag.surfaces") == read(expected + ".surfaces")) << bag;
    EXPECT_TRUE(read("bag.bt") == read(expected + ".bt")) << bag;
  }
};

TEST_F(Bags, OfDepthImagesGiveTheMapOfTheirFolder) {
  simulate_for_bag("sim", "--frames 2");
  run_well("map sim -o folder --resolution 0.05");
  EXPECT_GT(info("folder").at("surfaces"), 3);
  for (const auto& [bag, options] : {std::pair("lz4.bag", "packing=lz4 poses=pose depth=32FC1"),
                                     {"walk.db3", "poses=odometry depth=mono16"}}) {
    write_bag("sim", bag, options);
    expect_map_of(bag, "folder");
  }
  fs::create_directory(folder / "walk");
  write("walk/metadata.yaml", "");
  write_bag("sim", "walk/walk_0.mcap", "packing=lz4 depth=big poses=pose");
  expect_map_of("walk", "folder");
}

TEST_F(Bags, InfoTellsTopicsCountsAndTimes) {
  simulate_for_bag("sim", "--sensor spinning --frames 3");
  for (const std::string bag : {"walk.bag", "walk.db3", "walk.mcap"}) {
    write_bag("sim", bag);
    EXPECT_THAT(
        run_well("info " + bag).out,
        AllOf(HasSubstr("messages     6\n"), HasSubstr("duration     0.200 s\n"),
              HasSubstr("/lidar/points  sensor_msgs/PointCloud2          3     0.000 s     0.200 s")));
    const json contents = json::parse(run_well("info --json " + bag).out);
    EXPECT_EQ(contents.at("messages"), 6);
    EXPECT_EQ(contents.at("first_s"), 1.7e9);
    EXPECT_NEAR(contents.at("duration_s").get<double>(), 0.2, 1e-6);
    const json& topic = contents.at("topics").at(0);
    EXPECT_EQ(topic.at("name"), "/lidar/points");
    EXPECT_EQ(topic.at("type"), "sensor_msgs/PointCloud2");
    EXPECT_EQ(topic.at("messages"), 3);
    EXPECT_NEAR(topic.at("last_s").get<double>() - topic.at("first_s").get<double>(), 0.2, 1e-6);
  }
  EXPECT_THAT(error_of("info walk.bag --up z", 2), HasSubstr("a bag"));
}

TEST_F(Bags, WhatWasChosenIsSaid) {
  simulate_for_bag("sim", "--sensor spinning --frames 2");
  write_bag("sim", "walk.mcap");
  EXPECT_THAT(run_well("map walk.mcap -o m").out,
              AllOf(HasSubstr("walk.mcap: scans: 2 messages of /lidar/points (sensor_msgs/PointCloud2)\n"),
                    HasSubstr("walk.mcap: poses: tf of lidar in map")));
  EXPECT_THAT(error_of("map walk.mcap -o n --topic /camera", 1),
              AllOf(HasSubstr("no topic /camera"), HasSubstr("/lidar/points (sensor_msgs/PointCloud2)")));
}

/// The commands of docs/usage.md, as they stand there.
TEST_F(Bags, TheDocumentedCommandsRun) {
  simulate_for_bag("sim", "--sensor spinning --frames 1");
  for (const std::string bag : {"walk.bag", "walk.mcap"}) write_bag("sim", bag, "poses=chain");
  simulate_for_bag("depth", "--frames 1");
  write_bag("depth", "kitchen.db3", "poses=odometry");
  fs::create_directory(folder / "maps");
  std::ifstream usage(test::paths::source() + "/docs/usage.md");
  std::string line;
  while (std::getline(usage, line) && line != "## Bags") {
  }
  while (std::getline(usage, line) && line != "```sh") {
  }
  int commands = 0;
  while (std::getline(usage, line) && line != "```") {
    ASSERT_TRUE(line.starts_with("octosurf ")) << line;
    run_well(line.substr(9, line.find('#') - 9));
    ++commands;
  }
  EXPECT_GE(commands, 4);
}

}  // namespace
}  // namespace octosurf::test
