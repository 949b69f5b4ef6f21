#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/readers/cloud_rows.hpp"

#include <algorithm>
#include <map>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

using Words = std::vector<std::string_view>;

const std::map<std::string_view, Scalar> scalars{
    {"char", Scalar::int8},       {"uchar", Scalar::uint8},    {"int8", Scalar::int8},
    {"uint8", Scalar::uint8},     {"short", Scalar::int16},    {"ushort", Scalar::uint16},
    {"int16", Scalar::int16},     {"uint16", Scalar::uint16},  {"int", Scalar::int32},
    {"uint", Scalar::uint32},     {"int32", Scalar::int32},    {"uint32", Scalar::uint32},
    {"int64", Scalar::int64},     {"uint64", Scalar::uint64},  {"float", Scalar::float32},
    {"float32", Scalar::float32}, {"double", Scalar::float64}, {"float64", Scalar::float64}};

constexpr std::size_t most_elements = 256;  // quadratic comparison; files have two or three

struct Property {
  std::string_view name;
  Scalar type = Scalar::none;
  Scalar count = Scalar::none;  ///< of a list: the type of its length
};

struct Element {
  std::string_view name;
  std::size_t count = 0;
  std::vector<Property> properties{};
  std::size_t step = 0;  ///< bytes of one, without lists
  bool lists = false;
};

class PlyReader {
 public:
  PlyReader(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {}

  Cloud read() {
    read_header();
    const auto vertex = std::find_if(elements_.begin(), elements_.end(),
                                     [](const Element& element) { return element.name == "vertex"; });
    if (vertex == elements_.end() || found_ != std::array{1, 1, 1})
      refuse("a PLY without one each of x, y and z as real numbers per vertex, which are in metres");
    if (vertex->count == 0) refuse("a cloud without points");
    if (format_ != "ascii" && format_ != "binary_big_endian" && format_ != "binary_little_endian")
      refuse("PLY format is neither ascii nor binary");
    std::string_view data = lines_.rest();
    for (auto element = elements_.begin(); element != vertex; ++element) skip(*element, data);
    const Lines rows = lines_;
    if (vertex->lists) time_ = {};
    Cloud cloud = format_ == "ascii" ? text(*vertex) : binary(*vertex, data);
    if (time_.place) time_.place->step = vertex->step;
    cloud.times = format_ == "ascii" ? text_times(rows, time_, vertex->count, file_)
                                     : binary_times(data, time_, swaps(), vertex->count);
    return cloud;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Error::Kind::data, file_.string(), what, "write the PLY file again, as plain vertices");
  }

  void read_header() {
    for (std::string_view line; lines_.next(line);) {
      const Words words = words_of(line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply") continue;
      if (words[0] == "end_header") return;
      if (words[0] == "format" && words.size() == 3)
        format_ = words[1];
      else if (words[0] == "element" && words.size() == 3)
        take_element(words);
      else if (words[0] == "property" && words.size() >= 3 && !elements_.empty())
        take_property(words, elements_.back());
      else
        refuse(std::string("PLY header line '").append(words[0].substr(0, 20)) + "' is not understood");
    }
    refuse("truncated or damaged PLY header");
  }

  void take_element(const Words& words) {
    if (elements_.size() == most_elements) refuse("a PLY of more than 256 elements");
    for (const auto& known : elements_)
      if (known.name == words[1])
        refuse("PLY element " + std::string(words[1].substr(0, 20)) + " is defined twice");
    elements_.push_back({words[1], count_in_header(words[2], file_)});
  }

  Scalar scalar(std::string_view word) const {
    const auto type = scalars.find(word);
    if (type == scalars.end())
      refuse(std::string("PLY type '").append(word.substr(0, 20)) + "' is not known");
    return type->second;
  }

  void take_property(const Words& words, Element& element) {
    Property property{words.back()};
    if (words[1] == "list") {
      if (words.size() != 5) refuse("a PLY list without the types of its length and its values");
      property.count = scalar(words[2]);
      property.type = scalar(words[3]);
      if (is_real(property.count)) refuse("a PLY list whose length is no whole number");
      element.lists = true;
    } else {
      property.name = words[2];
      property.type = scalar(words[1]);
      if (const auto axis = axis_of(property.name); axis && element.name == "vertex") {
        found_[*axis] += is_real(property.type) ? 1 : 2;
        xyz_[*axis] = {element.step, 0, element.properties.size(), property.type};
      }
      if (element.name == "vertex")
        time_.note(property.name, {element.step, 0, element.properties.size(), property.type});
      element.step += size_of(property.type);
    }
    element.properties.push_back(property);
    if (element.step > largest_step || element.properties.size() > largest_step)
      refuse("a PLY with more than 65536 bytes per point");
  }

  /// Skips the elements before the vertices.
  void skip(const Element& element, std::string_view& data) {
    if (format_ == "ascii") {
      std::string_view line;
      for (std::size_t i = 0; i < element.count; ++i)
        if (!lines_.next(line)) refuse_truncated(element);
    } else if (element.lists) {
      for (std::size_t i = 0; i < element.count; ++i)
        walk(element, data, [](const Property&, const char*) {});
    } else if (element.step > 0) {
      if (data.size() / element.step < element.count) refuse_truncated(element);
      data.remove_prefix(element.step * element.count);
    }
  }

  /// Calls `visit` with each property of one element that is no list, and skips it.
  template <class Visit>
  void walk(const Element& element, std::string_view& data, const Visit& visit) {
    const auto skip_bytes = [&](std::size_t count, std::size_t size) {
      if (count > data.size() / size) refuse_truncated(element);
      data.remove_prefix(count * size);
    };
    for (const Property& property : element.properties) {
      const char* const place = data.data();
      if (property.count == Scalar::none) {
        skip_bytes(1, size_of(property.type));
        visit(property, place);
        continue;
      }
      const std::string_view head = data;
      skip_bytes(1, size_of(property.count));
      const double count = value_of(head, {0, 0, 0, property.count}, 0, swaps());
      if (count < 0 || count > static_cast<double>(data.size())) refuse_truncated(element);
      skip_bytes(static_cast<std::size_t>(count), size_of(property.type));
    }
  }

  bool swaps() const { return (format_ == "binary_big_endian") == little_endian_host; }

  [[noreturn]] void refuse_truncated(const Element& element) const {
    refuse("truncated PLY: " + std::to_string(element.count) + " of element " +
           std::string(element.name.substr(0, 20)) + " announced");
  }

  Cloud text(const Element& vertex) {
    for (const Field& c : xyz_)
      for (std::size_t i = 0; i < c.column; ++i)
        if (vertex.properties[i].count != Scalar::none)
          refuse("an ascii PLY with a list before its coordinates is not supported");
    return text_points(lines_, xyz_, vertex.count, vertex.properties.size(), file_, vertex.lists);
  }

  Cloud binary(const Element& vertex, std::string_view data) {
    if (data.size() / std::max<std::size_t>(1, vertex.step) < vertex.count) refuse_truncated(vertex);
    std::string packed;
    if (vertex.lists) {  // their lengths differ: the coordinates alone have a step
      std::size_t step = 0;
      for (const Property& property : vertex.properties) {
        const auto axis = axis_of(property.name);
        if (!axis) continue;
        xyz_[*axis].offset = step;
        step += size_of(property.type);
      }
      packed.reserve(step * vertex.count);
      for (std::size_t i = 0; i < vertex.count; ++i)
        walk(vertex, data, [&](const Property& property, const char* place) {
          if (axis_of(property.name)) packed.append(place, size_of(property.type));
        });
      data = packed;
      for (Field& c : xyz_) c.step = step;
    } else {
      for (Field& c : xyz_) c.step = vertex.step;
    }
    return binary_points(data, xyz_, swaps(), vertex.count);
  }

  const std::filesystem::path& file_;
  Lines lines_;
  std::string_view format_;
  std::vector<Element> elements_;
  Coordinates xyz_;
  TimeField time_;
  std::array<int, 3> found_{};
};

}  // namespace

Cloud read_ply(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  return PlyReader(file, bytes).read();
}

}  // namespace octosurf::io
