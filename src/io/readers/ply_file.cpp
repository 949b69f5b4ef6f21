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

struct Element {
  std::string_view name;
  std::size_t count = 0;
  std::size_t columns = 0;  ///< properties
  std::size_t step = 0;     ///< bytes of one, without lists
  bool lists = false;
};

class PlyReader {
 public:
  PlyReader(const std::filesystem::path& file, std::string_view bytes) : file_(file), lines_(bytes) {}

  Cloud read() {
    read_header();
    const auto vertex =
        std::ranges::find_if(elements_, [](const Element& element) { return element.name == "vertex"; });
    if (vertex == elements_.end() || found_ != std::array{1, 1, 1})
      refuse("a PLY without one each of x, y and z as real numbers per vertex, which are in metres");
    if (vertex->count == 0) refuse("a cloud without points");
    if (format_ != "ascii" && format_ != "binary_big_endian" && format_ != "binary_little_endian")
      refuse("PLY format is neither ascii nor binary");
    std::string_view data = lines_.rest();
    for (auto element = elements_.begin(); element != vertex; ++element) skip(*element, data);
    if (vertex->lists) refuse("a PLY whose vertices have lists");
    const Lines rows = lines_;
    for (Field& c : xyz_) c.step = vertex->step;
    if (time_.place) time_.place->step = vertex->step;
    if (format_ != "ascii" && data.size() / std::max<std::size_t>(1, vertex->step) < vertex->count)
      refuse_truncated(*vertex);
    Cloud cloud = format_ == "ascii" ? text_points(lines_, xyz_, vertex->count, vertex->columns, file_)
                                     : binary_points(data, xyz_, swaps(), vertex->count);
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
    if (words[1] == "list") {
      if (words.size() != 5) refuse("a PLY list without the types of its length and its values");
      element.lists = true;
    } else {
      const Field field{element.step, 0, element.columns, scalar(words[1])};
      if (const auto axis = axis_of(words[2]); axis && element.name == "vertex") {
        found_[*axis] += is_real(field.type) ? 1 : 2;
        xyz_[*axis] = field;
      }
      if (element.name == "vertex") time_.note(words[2], field);
      element.step += size_of(field.type);
    }
    ++element.columns;
    if (element.step > largest_step || element.columns > largest_step)
      refuse("a PLY with more than 65536 bytes per point");
  }

  /// Skips the elements before the vertices.
  void skip(const Element& element, std::string_view& data) {
    if (format_ == "ascii") {
      std::string_view line;
      for (std::size_t i = 0; i < element.count; ++i)
        if (!lines_.next(line)) refuse_truncated(element);
    } else if (element.lists) {
      refuse("a PLY with lists before its vertices");
    } else if (element.step > 0) {
      if (data.size() / element.step < element.count) refuse_truncated(element);
      data.remove_prefix(element.step * element.count);
    }
  }

  bool swaps() const { return (format_ == "binary_big_endian") == little_endian_host; }

  [[noreturn]] void refuse_truncated(const Element& element) const {
    refuse("truncated PLY: " + std::to_string(element.count) + " of element " +
           std::string(element.name.substr(0, 20)) + " announced");
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
