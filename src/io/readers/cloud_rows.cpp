#include "io/readers/cloud_rows.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::string_view blanks = " \t\r\v\f";

template <typename Real>
void copy(const char* from, std::size_t step, bool swap_bytes, int axis,
          std::vector<Eigen::Vector3f>& points) {
  for (auto& point : points) {
    std::array<char, sizeof(Real)> bytes;
    std::memcpy(bytes.data(), from, sizeof(Real));
    if (swap_bytes) std::reverse(bytes.begin(), bytes.end());
    Real value;
    std::memcpy(&value, bytes.data(), sizeof(Real));
    point[axis] = static_cast<float>(value);
    from += step;
  }
}

}  // namespace

bool Lines::next(std::string_view& line) {
  if (text_.empty()) return false;
  const auto end = std::min(text_.find('\n'), text_.size());
  line = text_.substr(0, end);
  if (line.ends_with('\r')) line.remove_suffix(1);
  text_.remove_prefix(std::min(end + 1, text_.size()));
  ++number_;
  return true;
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::size_t most = largest_step + 2;  // a keyword, a word per value, and one too many
  std::vector<std::string_view> words;
  while (words.size() < most) {
    const auto begin = line.find_first_not_of(blanks);
    if (begin == std::string_view::npos) break;
    line.remove_prefix(begin);
    const auto length = std::min(line.find_first_of(blanks), line.size());
    words.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
  return words;
}

std::uint32_t count_in_header(std::string_view word, const std::filesystem::path& file) {
  std::uint32_t value = 0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc() && stop == word.data() + word.size()) return value;
  throw Error(Error::Kind::data, file.string(),
              std::string("'").append(word.substr(0, 20)) + "' in the header is not a count",
              "write the file again");
}

Eigen::Vector3f point_or_nothing(const Eigen::Vector3f& point) {
  if (!point.isZero(0)) return point;
  return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
}

std::vector<Eigen::Vector3f> binary_points(std::string_view bytes, const Coordinates& xyz, std::size_t points,
                                           bool swap_bytes) {
  std::vector<Eigen::Vector3f> result(points);
  for (int axis = 0; axis < 3; ++axis) {
    const Coordinate& c = xyz[axis];
    if (c.is_double)
      copy<double>(bytes.data() + c.offset, c.step, swap_bytes, axis, result);
    else
      copy<float>(bytes.data() + c.offset, c.step, swap_bytes, axis, result);
  }
  for (auto& point : result) point = point_or_nothing(point);
  return result;
}

std::vector<Eigen::Vector3f> text_points(Lines& lines, const Coordinates& xyz, std::size_t points,
                                         std::size_t columns, const std::filesystem::path& file) {
  std::vector<Eigen::Vector3f> result;
  result.reserve(std::min(points, lines.rest().size() / (2 * columns) + 1));  // a digit and a blank a value
  for (std::string_view line; result.size() < points && lines.next(line);) {
    const auto words = words_of(line);
    if (words.empty()) continue;
    if (words.size() != columns)
      throw Error(Error::Kind::data, at_line(file, lines.number()),
                  std::to_string(words.size()) + " values where the header says " + std::to_string(columns),
                  "write the file again");
    Eigen::Vector3f point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = static_cast<float>(number(words[xyz[axis].column], file, lines.number()));
    result.push_back(point_or_nothing(point));
  }
  if (result.size() == points) return result;
  throw Error(Error::Kind::data, file.string(),
              "truncated: " + std::to_string(result.size()) + " of " + std::to_string(points) + " points",
              "write the file again");
}

}  // namespace octosurf::io
