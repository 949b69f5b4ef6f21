#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// The messages as their .msg files define them, decoded by hand. XCDR1: the four bytes of encapsulation do
// not count; a value of n bytes begins at a multiple of n; a string is its length with a zero, then both; a
// list its length, then its elements.

namespace octosurf::test::ros {

using Json = nlohmann::json;

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
inline const std::map<std::string, Fields> messages{
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
inline Json json_of(float value) {
  if (std::isnan(value)) return nullptr;
  char text[32];
  return Json::parse(text, std::to_chars(text, text + sizeof text, value).ptr);
}

inline Json decode(CdrReader& in, const std::string& type) {
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
inline Json decode(const std::string& bytes, const std::string& type) {
  CdrReader in(bytes);
  Json message = decode(in, type);
  EXPECT_EQ(in.left(), 0U);
  return message;
}

/// grid_map's atPosition(), start indices 0: getIndexFromPosition() counts from the +x, +y corner, and its
/// matrices are column-major, as multiArrayMessageCopyToMatrixEigen() checks by the first label. NaN for
/// null.
inline float at_position(const Json& map, const std::string& layer, double x, double y) {
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

}  // namespace octosurf::test::ros
