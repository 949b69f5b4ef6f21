#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

// The messages as their .msg files define them, decoded by hand. XCDR1: the four bytes of encapsulation do
// not count; a value of n bytes begins at a multiple of n; a string is its length with a zero, then both; a
// list its length, then its elements.

namespace octosurf::test::ros {

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
  std::string text() {
    const auto size = number<std::uint32_t>();
    std::string value = bytes_.substr(4 + position_, size);
    position_ += size;
    EXPECT_EQ(value.back(), '\0');
    value.pop_back();
    return value;
  }
  template <class Element, class Read>
  std::vector<Element> list(const Read& read) {
    std::vector<Element> elements(number<std::uint32_t>());
    for (Element& element : elements) element = read();
    return elements;
  }
  bool at_end() const { return 4 + position_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

using Pose = std::array<double, 7>;  // position x y z, orientation x y z w
using Point2d = std::array<float, 2>;
using Polygon2d = std::vector<Point2d>;
struct PolygonWithHoles2d {
  Polygon2d outer_boundary;
  std::vector<Polygon2d> holes;
  bool operator==(const PolygonWithHoles2d&) const = default;
};
struct PlanarRegion {
  Pose plane_parameters{};
  std::array<float, 4> bbox2d{};  // min x, min y, max x, max y
  PolygonWithHoles2d boundary;
  std::vector<PolygonWithHoles2d> insets;
  bool operator==(const PlanarRegion&) const = default;
};
struct Dimension {
  std::string label;
  std::uint32_t size = 0, stride = 0;
  bool operator==(const Dimension&) const = default;
};
struct Float32MultiArray {
  std::vector<Dimension> dim;
  std::uint32_t data_offset = 0;
  std::vector<float> data;
};
struct GridMap {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  std::string frame_id;
  double resolution = 0, length_x = 0, length_y = 0;
  Pose pose{};
  std::vector<std::string> layers, basic_layers;
  std::vector<Float32MultiArray> data;
  std::uint16_t outer_start_index = 0, inner_start_index = 0;

  const Float32MultiArray& layer(const std::string& name) const {
    for (std::size_t i = 0; i < layers.size(); ++i)
      if (layers[i] == name) return data.at(i);
    throw std::out_of_range("no layer " + name);  // as grid_map::GridMap::get()
  }
};
struct PlanarTerrain {
  std::vector<PlanarRegion> planar_regions;
  GridMap gridmap;
};

inline Pose read_pose(CdrReader& in) {
  Pose pose;
  for (double& value : pose) value = in.number<double>();
  return pose;
}
inline Polygon2d read_ring(CdrReader& in) {
  return in.list<Point2d>([&] {
    const float x = in.number<float>();
    return Point2d{x, in.number<float>()};
  });
}
inline PolygonWithHoles2d read_polygon(CdrReader& in) {
  PolygonWithHoles2d polygon;
  polygon.outer_boundary = read_ring(in);
  polygon.holes = in.list<Polygon2d>([&] { return read_ring(in); });
  return polygon;
}
inline PlanarRegion read_region(CdrReader& in) {
  PlanarRegion region;
  region.plane_parameters = read_pose(in);
  for (float& value : region.bbox2d) value = in.number<float>();
  region.boundary = read_polygon(in);
  region.insets = in.list<PolygonWithHoles2d>([&] { return read_polygon(in); });
  return region;
}
inline Float32MultiArray read_layer(CdrReader& in) {
  Float32MultiArray layer;
  layer.dim = in.list<Dimension>([&] {
    Dimension dimension;
    dimension.label = in.text();
    dimension.size = in.number<std::uint32_t>();
    dimension.stride = in.number<std::uint32_t>();
    return dimension;
  });
  layer.data_offset = in.number<std::uint32_t>();
  layer.data = in.list<float>([&] { return in.number<float>(); });
  return layer;
}
inline GridMap read_grid_map(CdrReader& in) {
  GridMap map;
  map.sec = in.number<std::int32_t>();
  map.nanosec = in.number<std::uint32_t>();
  map.frame_id = in.text();
  map.resolution = in.number<double>();
  map.length_x = in.number<double>();
  map.length_y = in.number<double>();
  map.pose = read_pose(in);
  map.layers = in.list<std::string>([&] { return in.text(); });
  map.basic_layers = in.list<std::string>([&] { return in.text(); });
  map.data = in.list<Float32MultiArray>([&] { return read_layer(in); });
  map.outer_start_index = in.number<std::uint16_t>();
  map.inner_start_index = in.number<std::uint16_t>();
  return map;
}
inline PlanarTerrain read_terrain(CdrReader& in) {
  PlanarTerrain terrain;
  terrain.planar_regions = in.list<PlanarRegion>([&] { return read_region(in); });
  terrain.gridmap = read_grid_map(in);
  return terrain;
}

using Json = nlohmann::json;

inline Pose read_pose(const Json& in) {
  const Json &p = in.at("position"), &q = in.at("orientation");
  return {p.at("x"), p.at("y"), p.at("z"), q.at("x"), q.at("y"), q.at("z"), q.at("w")};
}
inline Polygon2d read_ring(const Json& in) {
  Polygon2d ring;
  for (const Json& p : in.at("points")) ring.push_back({p.at("x"), p.at("y")});
  return ring;
}
inline PolygonWithHoles2d read_polygon(const Json& in) {
  PolygonWithHoles2d polygon{read_ring(in.at("outer_boundary")), {}};
  for (const Json& hole : in.at("holes")) polygon.holes.push_back(read_ring(hole));
  return polygon;
}
inline PlanarRegion read_region(const Json& in) {
  const Json& box = in.at("bbox2d");
  PlanarRegion region{read_pose(in.at("plane_parameters")),
                      {box.at("min_x"), box.at("min_y"), box.at("max_x"), box.at("max_y")},
                      read_polygon(in.at("boundary")),
                      {}};
  for (const Json& inset : in.at("insets")) region.insets.push_back(read_polygon(inset));
  return region;
}
inline GridMap read_grid_map(const Json& in) {
  const Json &info = in.at("info"), &header = info.at("header");
  GridMap map;
  map.sec = header.at("stamp").at("sec");
  map.nanosec = header.at("stamp").at("nanosec");
  map.frame_id = header.at("frame_id");
  map.resolution = info.at("resolution");
  map.length_x = info.at("length_x");
  map.length_y = info.at("length_y");
  map.pose = read_pose(info.at("pose"));
  map.layers = in.at("layers").get<std::vector<std::string>>();
  map.basic_layers = in.at("basic_layers").get<std::vector<std::string>>();
  for (const Json& from : in.at("data")) {
    Float32MultiArray& layer = map.data.emplace_back();
    for (const Json& d : from.at("layout").at("dim"))
      layer.dim.push_back({d.at("label"), d.at("size"), d.at("stride")});
    layer.data_offset = from.at("layout").at("data_offset");
    for (const Json& value : from.at("data"))
      layer.data.push_back(value.is_null() ? std::numeric_limits<float>::quiet_NaN() : value.get<float>());
  }
  map.outer_start_index = in.at("outer_start_index");
  map.inner_start_index = in.at("inner_start_index");
  return map;
}

inline void expect_same(const GridMap& a, const GridMap& b) {
  EXPECT_EQ(a.frame_id, b.frame_id);
  EXPECT_EQ(a.resolution, b.resolution);
  EXPECT_EQ(a.length_x, b.length_x);
  EXPECT_EQ(a.length_y, b.length_y);
  EXPECT_EQ(a.pose, b.pose);
  EXPECT_EQ(a.layers, b.layers);
  EXPECT_EQ(a.basic_layers, b.basic_layers);
  ASSERT_EQ(a.data.size(), b.data.size());
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    EXPECT_EQ(a.data[i].dim, b.data[i].dim);
    ASSERT_EQ(a.data[i].data.size(), b.data[i].data.size());
    for (std::size_t k = 0; k < a.data[i].data.size(); ++k)
      EXPECT_TRUE(a.data[i].data[k] == b.data[i].data[k] ||
                  (std::isnan(a.data[i].data[k]) && std::isnan(b.data[i].data[k])));
  }
}

/// grid_map's atPosition(), start indices 0: getIndexFromPosition() counts from the +x, +y corner, and its
/// matrices are column-major, as multiArrayMessageCopyToMatrixEigen() checks by the first label.
inline float at_position(const GridMap& map, const std::string& layer, double x, double y) {
  const Float32MultiArray& array = map.layer(layer);
  EXPECT_EQ(array.dim.at(0).label, "column_index");
  EXPECT_EQ(array.dim.at(1).label, "row_index");
  const std::size_t columns = array.dim[0].size, rows = array.dim[1].size;
  EXPECT_EQ(array.data.size(), rows * columns);
  const auto row = static_cast<std::size_t>((map.pose[0] + map.length_x / 2 - x) / map.resolution);
  const auto column = static_cast<std::size_t>((map.pose[1] + map.length_y / 2 - y) / map.resolution);
  EXPECT_LT(row, rows);
  EXPECT_LT(column, columns);
  return array.data[column * rows + row];
}

}  // namespace octosurf::test::ros
