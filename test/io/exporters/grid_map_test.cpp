// GridMap messages as grid_map_ros reads them.
#include "io/exporters/planner_fixture.hpp"
#include "io/exporters/room_snapshot.hpp"
#include "io/ros_messages.hpp"

#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

class GridMapMessage : public testing::Test {
 protected:
  const Snapshot room_ = make_room();
};

HeightGrid room_grid(const Snapshot& room, HeightGridOptions options = {}) {
  options.cell = 0.1;
  return height_grid(room, options);
}

TEST_F(GridMapMessage, ReadersFindHeightNormalAndSurfaceAtAPosition) {
  const ros::Json map = ros::decode(grid_map_message(room_grid(room_), "map"), "GridMap"),
                  &info = map.at("info");
  EXPECT_EQ(info.at("header").at("frame_id"), "map");
  EXPECT_EQ(info.at("resolution"), 0.1);
  EXPECT_NEAR(info.at("length_x"), 6, 1e-9);
  EXPECT_NEAR(info.at("length_y"), 4, 1e-9);
  EXPECT_NEAR(info.at("pose").at("position").at("x"), 3, 1e-9);  // of the centre
  EXPECT_NEAR(info.at("pose").at("position").at("y"), 2, 1e-9);
  EXPECT_EQ(map.at("outer_start_index"), 0);
  EXPECT_EQ(map.at("inner_start_index"), 0);
  EXPECT_EQ(map.at("layers"), ros::Json({"elevation", "normal_x", "normal_y", "normal_z", "surface_id"}));
  // Floor, table, the third step, the floor's hole that the table covers.
  EXPECT_NEAR(ros::at_position(map, "elevation", 0.55, 0.55), 0, 1e-6);
  EXPECT_EQ(ros::at_position(map, "surface_id", 0.55, 0.55), 2);
  EXPECT_NEAR(ros::at_position(map, "elevation", 1.65, 1.25), 0.75, 1e-6);
  EXPECT_EQ(ros::at_position(map, "surface_id", 1.65, 1.25), 20);
  EXPECT_NEAR(ros::at_position(map, "elevation", 5.15, 3.55), 0.54, 1e-6);
  EXPECT_EQ(ros::at_position(map, "normal_z", 5.15, 3.55), 1);
  EXPECT_EQ(ros::at_position(map, "normal_x", 5.15, 3.55), 0);
  EXPECT_NEAR(ros::at_position(map, "elevation", 2.25, 1.75), 0.75, 1e-6);
}

TEST_F(GridMapMessage, CellsWithoutASurfaceAreNaN) {
  HeightGridOptions options;
  options.below = 0.5;
  const HeightGrid grid = room_grid(room_, options);
  const ros::Json map = ros::decode(grid_map_message(grid, "world"), "GridMap");
  EXPECT_TRUE(std::isnan(ros::at_position(map, "elevation", 2.25, 1.75)));  // the hole under the table
  EXPECT_EQ(ros::at_position(map, "elevation", 1.65, 1.25), 0);             // the floor under it
}

/// Fast CDR leaves what aligns a value as it finds it.
TEST_F(GridMapMessage, IsTheSameToTheByteWhateverTheMemoryHeldBefore) {
  const HeightGrid grid = room_grid(room_);
  std::vector<std::string> messages;
  for (const char before : {'a', 'b'}) {
    for (std::size_t size = 64; size < (1U << 20); size *= 2)
      std::vector<std::string>(4, std::string(size, before));
    messages.push_back(grid_map_message(grid, "a frame"));
    ros::decode(messages.back(), "GridMap");  // asks for zeros
  }
  EXPECT_TRUE(messages[0] == messages[1]);
}

TEST_F(GridMapMessage, WithoutCellsItIsRefused) { EXPECT_THROW(grid_map_message({}, "map"), Error); }

}  // namespace
}  // namespace octosurf::test
