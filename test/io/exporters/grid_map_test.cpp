// GridMap messages as grid_map_ros reads them, and height images.
#include "io/exporters/planner_fixture.hpp"
#include "io/exporters/room_snapshot.hpp"
#include "io/ros_messages.hpp"

#include <spng.h>

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
  EXPECT_TRUE(grid_map_message(grid, "map", MessageEncoding::cdr) == ros::bytes_of(path("grid.cdr")));
  const std::string packed = grid_map_message(grid, "map", MessageEncoding::ros1);
  EXPECT_EQ(packed.substr(0, 19), std::string(12, '\0') + std::string("\3\0\0\0map", 7));
  double resolution = 0;
  std::memcpy(&resolution, packed.data() + 19, sizeof resolution);
  EXPECT_EQ(resolution, 0.1);
  EXPECT_THROW(grid_map_message(grid, "map", MessageEncoding::other), Error);
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

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint16_t> pixels;
};

Image read_png(const std::filesystem::path& file) {
  const std::string bytes = ros::bytes_of(file);
  spng_ctx* context = spng_ctx_new(0);
  spng_set_png_buffer(context, bytes.data(), bytes.size());
  spng_ihdr header{};
  EXPECT_EQ(spng_get_ihdr(context, &header), 0);
  EXPECT_EQ(header.bit_depth, 16);
  EXPECT_EQ(header.color_type, SPNG_COLOR_TYPE_GRAYSCALE);
  Image image{header.width, header.height, {}};
  image.pixels.resize(std::size_t{header.width} * header.height);
  EXPECT_EQ(spng_decode_image(context, image.pixels.data(), 2 * image.pixels.size(), SPNG_FMT_PNG, 0), 0);
  spng_ctx_free(context);
  return image;
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
  export_height_image(grid, path("h\xF6he.png"));
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(path("h\xF6he.json"))).at("image"), replaced + ".png");
}

TEST_F(GridMapMessage, HeightImageGivesTheHeightsBack) {
  HeightGridOptions options;
  options.cell = 0.1;
  options.below = 0.5;
  const HeightGrid grid = height_grid(room_, options);
  export_height_image(grid, path("heights.png"));
  const auto about = nlohmann::json::parse(std::ifstream(path("heights.json")));
  const Image image = read_png(path("heights.png"));
  ASSERT_EQ(image.width, about.at("width").get<std::uint32_t>());
  ASSERT_EQ(image.height, about.at("height").get<std::uint32_t>());
  EXPECT_EQ(about.at("image"), "heights.png");
  int nothing = 0;
  for (Eigen::Index row = 0; row < grid.elevation.rows(); ++row)
    for (Eigen::Index column = 0; column < grid.elevation.cols(); ++column) {
      const Eigen::Vector2d at = grid.center_of(row, column);
      const double cell = about.at("cell"), x0 = about.at("origin")[0], y0 = about.at("origin")[1];
      const auto u = static_cast<std::size_t>(std::lround((at.x() - x0) / cell)),
                 v = static_cast<std::size_t>(std::lround((y0 - at.y()) / cell));
      const std::uint16_t value = image.pixels.at(v * image.width + u);
      nothing += value == 0;
      ASSERT_EQ(value == 0, std::isnan(grid.elevation(row, column)));
      if (value != 0) {
        EXPECT_NEAR(about.at("offset").get<double>() + about.at("scale").get<double>() * value,
                    grid.elevation(row, column), 0.51e-4);
      }
    }
  EXPECT_EQ(nothing, 48);  // the hole in the floor, which the table above 0.5 m no longer covers
}

TEST_F(GridMapMessage, NothingIsLeftOfWhatIsRefused) {
  EXPECT_THROW(export_grid_map({}, "map", path("grid.cdr")), Error);
  EXPECT_THROW(export_grid_map(room_grid(room_), "map", path("grid.png")), Error);
  EXPECT_THROW(export_height_image(room_grid(room_), path("grid.json")), Error);
  std::ofstream(path("taken.json")) << "precious";
  EXPECT_THROW(export_height_image(room_grid(room_), path("taken.png")), Error);
  EXPECT_EQ(ros::bytes_of(path("taken.json")), "precious");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

}  // namespace
}  // namespace octosurf::test
