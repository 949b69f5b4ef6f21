#include "io/readers/cloud_rows.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"

#include <algorithm>
#include <charconv>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::io {

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
    const char* place = bytes.data() + xyz[axis].offset;
    for (Eigen::Vector3f& point : result) {
      point[axis] = xyz[axis].is_double ? static_cast<float>(number_at<double>(place, swap_bytes))
                                        : number_at<float>(place, swap_bytes);
      place += xyz[axis].step;
    }
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

Cloud read_velodyne(const std::filesystem::path& file) {
  constexpr std::size_t step = 4 * sizeof(float);
  const std::string bytes = read_bytes(file, largest_cloud_file);
  if (bytes.empty() || bytes.size() % step != 0)
    throw Error(Error::Kind::data, file.string(),
                bytes.empty() ? "is empty" : "is not a list of float32 x y z reflectance",
                "the file is truncated or foreign");
  return {binary_points(bytes, {{{0, step}, {4, step}, {8, step}}}, bytes.size() / step, false),
          Eigen::Isometry3d::Identity(), false};
}

}  // namespace octosurf::io
