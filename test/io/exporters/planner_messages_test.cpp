// GridMap and PlanarTerrain messages, decoded from their definitions and asked what grid_map_ros, ocs2 and
// legged_perceptive ask.
#include "io/exporters/planner_messages.hpp"

#include "io/exporters/room_snapshot.hpp"
#include "io/files.hpp"
#include "planning/shapes.hpp"
#include "support/polygons.hpp"

#include <charconv>
#include <nlohmann/json.hpp>

#include <octosurf/planner_formats.hpp>
#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

using Json = nlohmann::json;

// The messages as their .msg files define them, decoded by hand. XCDR1: the four bytes of encapsulation do
// not count; a value of n bytes begins at a multiple of n; a string is its length with a zero, then both; a
// list its length, then its elements.

class CdrReader {
 public:
  explicit CdrReader(std::string bytes) : bytes_(std::move(bytes)) {
    EXPECT_EQ(bytes_.substr(0, 4), std::string("\0\1\0\0", 4));  // CDR_LE
  }
  template <class Number>
  Number number() {
    for (; position_ % sizeof(Number) != 0; ++position_) EXPECT_EQ(bytes_.at(4 + position_), 0) << "padding";
    Number value{};
    if (4 + position_ + sizeof(Number) > bytes_.size()) throw std::runtime_error("the message ends early");
    std::memcpy(&value, bytes_.data() + 4 + position_, sizeof(Number));
    position_ += sizeof(Number);
    return value;
  }
  std::string bytes(std::size_t size) {
    if (4 + position_ + size > bytes_.size()) throw std::runtime_error("the message ends early");
    position_ += size;
    return bytes_.substr(4 + position_ - size, size);
  }
  std::string text() {
    std::string value = bytes(number<std::uint32_t>());
    EXPECT_EQ(value.back(), '\0');
    value.pop_back();
    return value;
  }
  std::size_t left() const { return bytes_.size() - 4 - position_; }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

/// Names and types of fields, as .msg files have types.
using Fields = std::vector<std::pair<std::string, std::string>>;
const std::map<std::string, Fields> messages{
    {"Vector", {{"x", "float64"}, {"y", "float64"}, {"z", "float64"}}},
    {"Quaternion", {{"x", "float64"}, {"y", "float64"}, {"z", "float64"}, {"w", "float64"}}},
    {"Pose", {{"position", "Vector"}, {"orientation", "Quaternion"}}},
    {"Point2d", {{"x", "float32"}, {"y", "float32"}}},
    {"Polygon2d", {{"points", "Point2d[]"}}},
    {"PolygonWithHoles2d", {{"outer_boundary", "Polygon2d"}, {"holes", "Polygon2d[]"}}},
    {"Box2d", {{"min_x", "float32"}, {"min_y", "float32"}, {"max_x", "float32"}, {"max_y", "float32"}}},
    {"PlanarRegion",
     {{"plane_parameters", "Pose"},
      {"bbox2d", "Box2d"},
      {"boundary", "PolygonWithHoles2d"},
      {"insets", "PolygonWithHoles2d[]"}}},
    {"Time", {{"sec", "int32"}, {"nanosec", "uint32"}}},
    {"Header", {{"stamp", "Time"}, {"frame_id", "string"}}},
    {"GridMapInfo",
     {{"header", "Header"},
      {"resolution", "float64"},
      {"length_x", "float64"},
      {"length_y", "float64"},
      {"pose", "Pose"}}},
    {"Dimension", {{"label", "string"}, {"size", "uint32"}, {"stride", "uint32"}}},
    {"Layout", {{"dim", "Dimension[]"}, {"data_offset", "uint32"}}},
    {"Float32MultiArray", {{"layout", "Layout"}, {"data", "float32[]"}}},
    {"GridMap",
     {{"info", "GridMapInfo"},
      {"layers", "string[]"},
      {"basic_layers", "string[]"},
      {"data", "Float32MultiArray[]"},
      {"outer_start_index", "uint16"},
      {"inner_start_index", "uint16"}}},
    {"PlanarTerrain", {{"planarRegions", "PlanarRegion[]"}, {"gridmap", "GridMap"}}}};

/// The number of the shortest text that gives the float, as JSON has it; null for NaN.
Json json_of(float value) {
  if (std::isnan(value)) return nullptr;
  char text[32];
  return Json::parse(text, std::to_chars(text, text + sizeof text, value).ptr);
}

Json decode(CdrReader& in, const std::string& type) {
  if (type == "string") return in.text();
  if (type == "uint16") return in.number<std::uint16_t>();
  if (type == "int32") return in.number<std::int32_t>();
  if (type == "uint32") return in.number<std::uint32_t>();
  if (type == "float32") return json_of(in.number<float>());
  if (type == "float64") return in.number<double>();
  Json value;
  if (type.ends_with("[]")) {
    value = Json::array();
    for (auto left = in.number<std::uint32_t>(); left > 0; --left)
      value.push_back(decode(in, type.substr(0, type.size() - 2)));
    return value;
  }
  for (const auto& [name, of] : messages.at(type)) value[name] = decode(in, of);
  return value;
}
Json decode(const std::string& bytes, const std::string& type) {
  CdrReader in(bytes);
  Json message = decode(in, type);
  EXPECT_EQ(in.left(), 0U);
  return message;
}

/// grid_map's atPosition(), start indices 0: getIndexFromPosition() counts from the +x, +y corner, and its
/// matrices are column-major, as multiArrayMessageCopyToMatrixEigen() checks by the first label. NaN for
/// null.
float at_position(const Json& map, const std::string& layer, double x, double y) {
  const auto& layers = map.at("layers");
  const auto at = std::find(layers.begin(), layers.end(), layer);
  if (at == layers.end()) throw std::out_of_range("no layer " + layer);  // as grid_map::GridMap::get()
  const Json& array = map.at("data").at(static_cast<std::size_t>(at - layers.begin()));
  const Json &dim = array.at("layout").at("dim"), &info = map.at("info");
  EXPECT_EQ(dim.at(0).at("label"), "column_index");
  EXPECT_EQ(dim.at(1).at("label"), "row_index");
  const std::size_t columns = dim[0].at("size"), rows = dim[1].at("size");
  EXPECT_EQ(array.at("data").size(), rows * columns);
  const auto index = [&](const char* axis, const char* length, double place) {
    const double from =
        info.at("pose").at("position").at(axis).get<double>() + info.at(length).get<double>() / 2;
    return static_cast<std::size_t>((from - place) / info.at("resolution").get<double>());
  };
  const std::size_t row = index("x", "length_x", x), column = index("y", "length_y", y);
  EXPECT_LT(row, rows);
  EXPECT_LT(column, columns);
  const Json& value = array.at("data").at(column * rows + row);
  return value.is_null() ? std::nanf("") : value.get<float>();
}

/// With its normal tilted by `tilt_rad` towards a random direction, some metres from the origin.
PlannerSurface random_surface(std::mt19937_64& random, SurfaceId id, double tilt_rad) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), place(-8, 8);
  const double towards = angle(random);
  const Eigen::Vector3d axis(std::cos(towards), std::sin(towards), 0);
  PlannerSurface surface;
  surface.id = id;
  surface.T_world_surface.linear() =
      (Eigen::AngleAxisd(tilt_rad, axis) * Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  surface.T_world_surface.translation() = Eigen::Vector3d(place(random), place(random), place(random));
  return surface;
}

/// A level square table of 2 m with a square hole of 0.4 m in its middle, its inset by 0.1 m, and an island
/// of 0.2 m in the hole on which there is no room.
PlannerSurface table_with_hole(SurfaceId id) {
  using shapes::box;
  PlannerSurface table;
  table.id = id;
  table.T_world_surface.translation() = Eigen::Vector3d(3, -2, 0.75);
  table.polygons = {{box(0, 0, 2, 2), {shapes::reversed(box(0.8, 0.8, 0.4, 0.4))}},
                    {box(0.9, 0.9, 0.2, 0.2), {}}};
  table.insets = {{box(0.1, 0.1, 1.8, 1.8), {shapes::reversed(box(0.7, 0.7, 0.6, 0.6))}}};
  return table;
}

HeightGrid small_grid() {
  HeightGrid grid;
  grid.cell = 0.05;
  grid.center = {4, -1};
  grid.elevation = Eigen::MatrixXf::Constant(40, 44, 0.75F);
  grid.elevation(3, 5) = std::nanf("");
  grid.elevation(20, 20) = 0.25F;
  grid.elevation(20, 21) = std::nanf("");
  grid.surface = grid.elevation;
  grid.normal.fill(grid.elevation);
  return grid;
}

std::vector<octosurf::Polygon> polygon_of(const Json& from) {
  const auto ring = [](const Json& of) {
    Ring2 vertices;
    for (const Json& point : of.at("points"))
      vertices.emplace_back(point.at("x").get<float>(), point.at("y").get<float>());
    return vertices;
  };
  Polygon polygon{ring(from.at("outer_boundary")), {}};
  for (const Json& hole : from.at("holes")) polygon.holes.push_back(ring(hole));
  return {polygon};
}

Json written(const std::vector<PlannerSurface>& surfaces) {
  return decode(planar_terrain_message(surfaces, small_grid(), "odom"), "PlanarTerrain");
}

TEST(PlanarTerrainMessage, RegionsHavePoseBoxBoundaryAndInsetsInside) {
  const PlannerSurface table = table_with_hole(5);
  const Json regions = written({table}).at("planarRegions");
  ASSERT_EQ(regions.size(), 1u) << "not the island";
  const Json &region = regions[0], &insets = region.at("insets");
  EXPECT_EQ(region.at("plane_parameters"), Json::parse(R"({"position": {"x": 3, "y": -2, "z": 0.75},
                            "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}})"));
  EXPECT_EQ(region.at("bbox2d"), Json::parse(R"({"min_x": 0, "min_y": 0, "max_x": 2, "max_y": 2})"));
  EXPECT_EQ(region.at("boundary").at("holes").size(), 1u);
  ASSERT_EQ(insets.size(), 1u);
  EXPECT_EQ(insets[0].at("holes").size(), 1u);
  const auto boundary = polygon_of(region.at("boundary")), inset = polygon_of(insets[0]);
  EXPECT_EQ(invalid(boundary), "");
  EXPECT_NEAR(area(boundary), 4 - 0.16, 1e-6);
  EXPECT_NEAR(area(inset), 1.8 * 1.8 - 0.36, 1e-6);
  EXPECT_NEAR(intersection(boundary, inset).area, area(inset), 1e-6);
}

TEST(PlanarTerrainMessage, PosesTurnThePlaneIntoTheWorld) {
  std::mt19937_64 random = rng();
  std::vector<PlannerSurface> surfaces;
  for (int i = 0; i < 50; ++i) {
    PlannerSurface surface = random_surface(random, 1 + i, i * 79.0 / 49 * std::numbers::pi / 180);
    surface.polygons = surface.insets = {shapes::random_polygon(random)};
    surfaces.push_back(surface);
  }
  const Json regions = written(surfaces).at("planarRegions");
  ASSERT_EQ(regions.size(), surfaces.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Json &pose = regions[i].at("plane_parameters"), &p = pose.at("position"),
               &o = pose.at("orientation");
    const Eigen::Quaterniond q(o.at("w"), o.at("x"), o.at("y"), o.at("z"));
    const Eigen::Vector2d corner = polygon_of(regions[i].at("boundary"))[0].outer[0];
    const Eigen::Vector3d world =
        q * Eigen::Vector3d(corner.x(), corner.y(), 0) + Eigen::Vector3d(p.at("x"), p.at("y"), p.at("z"));
    const Eigen::Vector2d uv = surfaces[i].polygons[0].outer[0];
    EXPECT_LT((world - surfaces[i].T_world_surface * Eigen::Vector3d(uv.x(), uv.y(), 0)).norm(), 1e-6);
    // "Along gravity": they divide by the normal's z.
    EXPECT_GT((q * Eigen::Vector3d::UnitZ()).z(), 0.17);
  }
}

TEST(PlanarTerrainMessage, SteepAndCrampedRegionsAreLeftOut) {
  std::mt19937_64 random = rng();
  PlannerSurface wall = random_surface(random, 8, 81 * std::numbers::pi / 180);
  PlannerSurface ceiling = random_surface(random, 9, std::numbers::pi);
  wall.polygons = wall.insets = ceiling.polygons = ceiling.insets = {{shapes::box(0, 0, 1, 1), {}}};
  PlannerSurface cramped = table_with_hole(6);
  cramped.insets.clear();
  const Json regions = written({wall, ceiling, cramped, table_with_hole(7)}).at("planarRegions");
  EXPECT_EQ(regions.size(), 1u);
  for (const Json& region : regions) EXPECT_FALSE(region.at("insets").empty());
  EXPECT_THROW(planar_terrain_message({wall}, small_grid(), "map"), Error);
  EXPECT_THROW(planar_terrain_message({table_with_hole(5)}, {}, "map"), Error);
}

TEST(PlanarTerrainMessage, WithoutARegionItIsATerrainWithoutFootholds) {
  PlannerSurface cramped = table_with_hole(6);
  cramped.insets.clear();
  const std::vector<PlannerSurface> surfaces{cramped};
  const std::vector<io::TerrainRegion> none = io::terrain_regions(surfaces);
  EXPECT_TRUE(none.empty());
  const Json terrain = decode(
      io::cdr_of([&](io::MessageWriter& out) { io::write_planar_terrain(out, none, small_grid(), "odom"); }),
      "PlanarTerrain");
  EXPECT_TRUE(terrain.at("planarRegions").empty());
  EXPECT_EQ(terrain.at("gridmap"), written({table_with_hole(5)}).at("gridmap"));
}

TEST(PlanarTerrainMessage, EveryInsetGoesToThePolygonItLiesIn) {
  PlannerSurface surface;
  surface.id = 1;
  surface.polygons = {{shapes::box(0, 0, 1, 1), {}}, {shapes::box(2, 0, 1, 1), {}}};
  surface.insets = {{shapes::box(2.1, 0.1, 0.3, 0.8), {}},
                    {shapes::box(0, 0, 1, 1), {}},
                    {shapes::box(2.6, 0.1, 0.3, 0.8), {}}};
  const Json regions = written({surface}).at("planarRegions");
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(regions[0].at("insets").size(), 1u);
  EXPECT_EQ(regions[1].at("insets").size(), 2u);
}

TEST(PlanarTerrainMessage, TheGridHasTheLayersThatReadersDereferenceWithoutGaps) {
  const Json map = written({table_with_hole(5)}).at("gridmap");
  EXPECT_EQ(map.at("info").at("header").at("frame_id"), "odom");
  for (const Json& layer : map.at("data"))
    for (const Json& height : layer.at("data"))
      EXPECT_TRUE(height.is_number() && std::isfinite(height.get<double>()));
  const HeightGrid grid = small_grid();
  const auto at = [&](Eigen::Index row, Eigen::Index column, const char* layer) {
    const Eigen::Vector2d center = grid.center_of(row, column);
    return at_position(map, layer, center.x(), center.y());
  };
  EXPECT_EQ(at(20, 20, "elevation"), 0.25F);
  EXPECT_EQ(at(20, 21, "elevation"), 0.25F);  // the lowest on its rim
  EXPECT_EQ(at(3, 5, "elevation"), 0.75F);
  EXPECT_EQ(at(30, 30, "smooth_planar"), 0.75F);
  EXPECT_NEAR(at(20, 20, "smooth_planar"), (23 * 0.75 + 2 * 0.25) / 25, 1e-6);
}

/// Each gap by itself, over and over until nothing changes: slow and obvious.
Eigen::MatrixXf without_gaps_by_sweeps(const Eigen::MatrixXf& given) {
  constexpr float none = std::numeric_limits<float>::infinity();
  Eigen::MatrixXf lowest = given.unaryExpr([](float h) { return std::isnan(h) ? none : h; });
  const auto lower = [&](Eigen::Index r, Eigen::Index c, Eigen::Index r2, Eigen::Index c2) {
    if (r2 < 0 || c2 < 0 || r2 >= given.rows() || c2 >= given.cols()) return false;
    if (lowest(r2, c2) >= lowest(r, c)) return false;
    lowest(r, c) = lowest(r2, c2);
    return true;
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (Eigen::Index r = 0; r < given.rows(); ++r)
      for (Eigen::Index c = 0; c < given.cols(); ++c)
        if (std::isnan(given(r, c)))
          for (const auto& [dr, dc] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
            changed = lower(r, c, r + dr, c + dc) || changed;
  }
  return lowest;
}

TEST(TerrainLayers, GapsAreFilledAsBySweeps) {
  std::mt19937_64 random = rng();
  for (int round = 0; round < 50; ++round) {
    Eigen::MatrixXf heights(1 + random() % 12, 1 + random() % 12);
    for (float& height : heights.reshaped())
      height = random() % 2 == 0 ? std::nanf("") : static_cast<float>(random() % 100);
    heights(0, 0) = 50;
    EXPECT_EQ(io::without_gaps(heights), without_gaps_by_sweeps(heights));
  }
  EXPECT_TRUE(std::isnan(io::without_gaps(Eigen::MatrixXf::Constant(3, 2, std::nanf("")))(2, 1)));
}

TEST(TerrainLayers, MeanIsThatOfTheSquareAsFarAsTheGridReaches) {
  std::mt19937_64 random = rng();
  Eigen::MatrixXf heights(17, 9);
  for (float& height : heights.reshaped()) height = static_cast<float>(random() % 1000) / 1000;
  for (const double cells : {0.5, 1.0, 3.0, 4.0, 100.0}) {
    const Eigen::MatrixXf mean = io::mean_over(heights, cells);
    const auto reach = static_cast<Eigen::Index>(cells / 2);
    for (Eigen::Index r = 0; r < heights.rows(); ++r)
      for (Eigen::Index c = 0; c < heights.cols(); ++c) {
        const Eigen::Index r0 = std::max<Eigen::Index>(r - reach, 0),
                           r1 = std::min(r + reach, heights.rows() - 1);
        const Eigen::Index c0 = std::max<Eigen::Index>(c - reach, 0),
                           c1 = std::min(c + reach, heights.cols() - 1);
        EXPECT_NEAR(mean(r, c), heights.block(r0, c0, r1 - r0 + 1, c1 - c0 + 1).mean(), 1e-5);
      }
  }
}

HeightGrid room_grid(HeightGridOptions options = {}) {
  options.cell = 0.1;
  return height_grid(make_room(), options);
}

TEST(GridMapMessage, ReadersFindHeightNormalAndSurfaceAtAPosition) {
  const Json map = decode(grid_map_message(room_grid(), "map"), "GridMap"), &info = map.at("info");
  EXPECT_EQ(info.at("header").at("frame_id"), "map");
  EXPECT_EQ(info.at("resolution"), 0.1);
  EXPECT_NEAR(info.at("length_x"), 6, 1e-9);
  EXPECT_NEAR(info.at("length_y"), 4, 1e-9);
  EXPECT_NEAR(info.at("pose").at("position").at("x"), 3, 1e-9);  // of the centre
  EXPECT_NEAR(info.at("pose").at("position").at("y"), 2, 1e-9);
  EXPECT_EQ(map.at("outer_start_index"), 0);
  EXPECT_EQ(map.at("inner_start_index"), 0);
  EXPECT_EQ(map.at("layers"), Json({"elevation", "normal_x", "normal_y", "normal_z", "surface_id"}));
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

TEST(GridMapMessage, CellsWithoutASurfaceAreNaN) {
  HeightGridOptions options;
  options.below = 0.5;
  const HeightGrid grid = room_grid(options);
  const Json map = decode(grid_map_message(grid, "world"), "GridMap");
  EXPECT_TRUE(std::isnan(at_position(map, "elevation", 2.25, 1.75)));  // the hole under the table
  EXPECT_EQ(at_position(map, "elevation", 1.65, 1.25), 0);             // the floor under it
}

/// Fast CDR leaves what aligns a value as it finds it.
TEST(GridMapMessage, IsTheSameToTheByteWhateverTheMemoryHeldBefore) {
  const HeightGrid grid = room_grid();
  std::vector<std::string> messages;
  for (const char before : {'a', 'b'}) {
    for (std::size_t size = 64; size < (1U << 20); size *= 2)
      std::vector<std::string>(4, std::string(size, before));
    messages.push_back(grid_map_message(grid, "a frame"));
    decode(messages.back(), "GridMap");  // asks for zeros
  }
  EXPECT_TRUE(messages[0] == messages[1]);
}

TEST(GridMapMessage, WithoutCellsItIsRefused) { EXPECT_THROW(grid_map_message({}, "map"), Error); }

}  // namespace
}  // namespace octosurf::test
