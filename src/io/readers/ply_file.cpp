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

const std::map<std::string_view, std::size_t> scalar_bytes{
    {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
    {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
    {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};

constexpr std::size_t most_elements = 256;  // quadratic comparison; files have two or three

struct Element {
  std::string_view name;
  std::size_t count = 0;
  std::size_t step = 0;     ///< bytes of one
  std::size_t columns = 0;  ///< values of one
  bool lists = false;       ///< step and columns are then unused
};

class PlyReader {
 public:
  PlyReader(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {}

  Cloud read() {
    read_header();
    const auto vertex = std::find_if(elements_.begin(), elements_.end(),
                                     [](const Element& element) { return element.name == "vertex"; });
    if (vertex == elements_.end() || found_ != std::array{1, 1, 1})
      refuse("a PLY without one each of x, y and z as real numbers per vertex");
    if (vertex->lists) refuse("a PLY with lists per vertex is not supported");
    if (vertex->count == 0) refuse("a cloud without points");
    std::string_view data = lines_.rest();
    for (auto element = elements_.begin(); element != vertex; ++element) skip(*element, data);
    return {format_ == "ascii" ? text_points(lines_, xyz_, vertex->count, vertex->columns, file_)
                               : binary(*vertex, data),
            Eigen::Isometry3d::Identity(), false};
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
    elements_.push_back({words[1], count_in_header(words[2], file_), 0, 0, false});
  }

  void take_property(const Words& words, Element& element) {
    if (words[1] == "list") {
      element.lists = true;
      return;
    }
    const auto type = scalar_bytes.find(words[1]);
    if (type == scalar_bytes.end())
      refuse(std::string("PLY type '").append(words[1].substr(0, 20)) + "' is not known");
    const bool real = words[1].starts_with("float") || words[1].starts_with("double");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (element.name != "vertex" || words[2] != std::string_view("xyz").substr(axis, 1)) continue;
      found_[axis] += real ? 1 : 2;
      xyz_[axis] = {element.step, 0, element.columns, type->second == 8};
    }
    element.step += type->second;
    ++element.columns;
    if (element.step > largest_step) refuse("a PLY with more than 65536 bytes per point");
  }

  /// Skips the elements before the vertices.
  void skip(const Element& element, std::string_view& data) {
    if (element.count == 0) return;
    if (element.lists) refuse("a PLY with lists before its vertices is not supported");
    if (format_ == "ascii") {
      std::string_view line;
      for (std::size_t i = 0; i < element.count; ++i)
        if (!lines_.next(line)) refuse_truncated(element);
    } else {
      if (element.step > 0 && data.size() / element.step < element.count) refuse_truncated(element);
      data.remove_prefix(element.step * element.count);
    }
  }

  [[noreturn]] void refuse_truncated(const Element& element) const {
    refuse("truncated PLY: " + std::to_string(element.count) + " of element " +
           std::string(element.name.substr(0, 20)) + " announced");
  }

  std::vector<Eigen::Vector3f> binary(const Element& vertex, std::string_view data) {
    const bool big = format_ == "binary_big_endian";
    if (!big && format_ != "binary_little_endian") refuse("PLY format is neither ascii nor binary");
    if (data.size() / vertex.step < vertex.count) refuse_truncated(vertex);
    for (auto& c : xyz_) c.step = vertex.step;
    return binary_points(data, xyz_, vertex.count, big == little_endian_host);
  }

  const std::filesystem::path& file_;
  Lines lines_;
  std::string_view format_;
  std::vector<Element> elements_;
  Coordinates xyz_;
  std::array<int, 3> found_{};
};

}  // namespace

Cloud read_ply(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_cloud_file);
  return PlyReader(file, bytes).read();
}

}  // namespace octosurf::io
