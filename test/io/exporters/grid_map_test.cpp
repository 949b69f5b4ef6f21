// GridMap messages as grid_map_ros reads them.
#include "io/exporters/planner_fixture.hpp"
#include "io/exporters/room_snapshot.hpp"
#include "io/ros_messages.hpp"

#include <octosurf/error.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

class GridMapMessage : public PlannerFormats {
 protected:
  const Snapshot room_ = make_room();
};

HeightGrid room_grid(const Snapshot& room, double cell = 0.1) {
  HeightGridOptions options;
  options.cell = cell;
  return height_grid(room, options);
}

TEST_F(GridMapMessage, ReadersFindHeightNormalAndSurfaceAtAPosition) {
  export_grid_map(room_grid(room_), "map", path("grid.cdr"));
  ros::CdrReader in(ros::bytes_of(path("grid.cdr")));
  const ros::GridMap map = ros::read_grid_map(in);
  EXPECT_TRUE(in.at_end());
  EXPECT_EQ(map.frame_id, "map");
  EXPECT_EQ(map.resolution, 0.1);
  EXPECT_NEAR(map.length_x, 6, 1e-9);
  EXPECT_NEAR(map.length_y, 4, 1e-9);
  EXPECT_NEAR(map.pose[0], 3, 1e-9);  // of the centre
  EXPECT_NEAR(map.pose[1], 2, 1e-9);
  EXPECT_EQ(map.outer_start_index + map.inner_start_index, 0);
  EXPECT_EQ(map.layers,
            (std::vector<std::string>{"elevation", "normal_x", "normal_y", "normal_z", "surface_id"}));
  // Floor, table, the third step, the floor's hole that the table covers.
  EXPECT_NEAR(at_position(map, "elevation", 0.55, 0.55), 0, 1e-6);
  EXPECT_EQ(at_position(map, "surface_id", 0.55, 0.55), 2);
  EXPECT_NEAR(at_position(map, "elevation", 1.65, 1.25), 0.75, 1e-6);
  EXPECT_EQ(at_position(map, "surface_id", 1.65, 1.25), 20);
  EXPECT_NEAR(at_position(map, "elevation", 5.15, 3.55), 0.54, 1e-6);
  EXPECT_EQ(at_position(map, "normal_z", 5.15, 3.55), 1);
  EXPECT_EQ(at_position(map, "normal_x", 5.15, 3.55), 0);
  EXPECT_NEAR(at_position(map, "elevation", 2.25, 1.75), 0.75, 1e-6);
}

TEST_F(GridMapMessage, BytesAreThoseOfTheFile) {
  const HeightGrid grid = room_grid(room_);
  export_grid_map(grid, "map", path("grid.cdr"));
  EXPECT_TRUE(grid_map_message(grid, "map") == ros::bytes_of(path("grid.cdr")));
}

TEST_F(GridMapMessage, JsonSaysTheSameWithNullForNothing) {
  HeightGridOptions options;
  options.cell = 0.1;
  options.below = 0.5;
  const HeightGrid grid = height_grid(room_, options);
  export_grid_map(grid, "world", path("grid.cdr"));
  export_grid_map(grid, "world", path("grid.json"));
  ros::CdrReader in(ros::bytes_of(path("grid.cdr")));
  const ros::GridMap map = ros::read_grid_map(in);
  EXPECT_TRUE(std::isnan(at_position(map, "elevation", 2.25, 1.75)));  // the hole under the table
  EXPECT_EQ(at_position(map, "elevation", 1.65, 1.25), 0);             // the floor under it
  expect_same(ros::read_grid_map(ros::Json::parse(std::ifstream(path("grid.json")))), map);
}

/// Fast CDR leaves what aligns a value as it finds it.
TEST_F(GridMapMessage, IsTheSameToTheByteWhateverTheMemoryHeldBefore) {
  const HeightGrid grid = room_grid(room_);
  std::vector<std::string> files;
  for (const char* name : {"a.cdr", "b.cdr"}) {
    for (std::size_t size = 64; size < (1U << 20); size *= 2)
      std::vector<std::string>(4, std::string(size, files.empty() ? 'a' : 'b'));
    export_grid_map(grid, "a frame", path(name));
    files.push_back(ros::bytes_of(path(name)));
    ros::CdrReader in(files.back());
    ros::read_grid_map(in);  // asks for zeros
  }
  EXPECT_TRUE(files[0] == files[1]);
}

TEST_F(GridMapMessage, NamesThatAreNoUtf8EndNoExport) {
  const HeightGrid grid = room_grid(room_);
  const std::string replaced = "h\xEF\xBF\xBDhe";
  export_grid_map(grid, "h\xF6he", path("grid.json"));
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(path("grid.json"))).at("info").at("header").at("frame_id"),
            replaced);
}

TEST_F(GridMapMessage, NothingIsLeftOfWhatIsRefused) {
  EXPECT_THROW(export_grid_map({}, "map", path("grid.cdr")), Error);
  EXPECT_THROW(export_grid_map(room_grid(room_), "map", path("grid.png")), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace octosurf::test
