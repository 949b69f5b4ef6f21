#include "io/readers/cloud_rows.hpp"

#include "io/readers/cloud_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

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

namespace {

bool is_return(const Eigen::Vector3d& point) { return point.allFinite() && !point.isZero(0); }

/// The points given by `at(row, i)`, less their shift.
template <class At>
Cloud shifted(std::size_t width, std::size_t rows, const At& at) {
  constexpr std::size_t sampled = 255;  // their middle is that of all to some percent of their spread
  std::array<std::vector<double>, 3> sample;
  const std::size_t count = width * rows;
  for (std::size_t i = 0; i < count; i += 1 + count / sampled)
    if (const Eigen::Vector3d point = at(i / width, i % width); is_return(point))
      for (std::size_t axis = 0; axis < 3; ++axis) sample[axis].push_back(point[static_cast<int>(axis)]);
  Cloud result;
  for (std::size_t axis = 0; axis < 3 && !sample[0].empty(); ++axis) {
    const auto middle = sample[axis].begin() + static_cast<std::ptrdiff_t>(sample[axis].size() / 2);
    std::nth_element(sample[axis].begin(), middle, sample[axis].end());
    result.shift[static_cast<int>(axis)] = std::round(*middle);
  }
  if (result.shift.lpNorm<Eigen::Infinity>() < farthest_m) result.shift.setZero();
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  result.points.reserve(count);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t i = 0; i < width; ++i) {
      const Eigen::Vector3d point = at(row, i);
      result.points.push_back(point.isZero(0) ? Eigen::Vector3f::Constant(nan)
                                              : (point - result.shift).cast<float>().eval());
    }
  return result;
}

}  // namespace

Cloud binary_points(std::string_view bytes, const Coordinates& xyz, bool swap_bytes, std::size_t width,
                    std::size_t rows, std::size_t row) {
  // Of almost all clouds x, y and z have one type, which is looked at once.
  const bool one_type = xyz[1].type == xyz[0].type && xyz[2].type == xyz[0].type;
  Cloud read = with_type_of(one_type ? xyz[0].type : Scalar::none, [&](auto value) {
    return shifted(width, rows, [&](std::size_t r, std::size_t i) {
      Eigen::Vector3d point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Field& field = xyz[axis];
        const std::string_view of_row = bytes.substr(r * row);
        if (one_type)
          point[static_cast<int>(axis)] = static_cast<double>(
              number_at<decltype(value)>(of_row.data() + field.offset + i * field.step, swap_bytes));
        else
          point[static_cast<int>(axis)] = value_of(of_row, field, i, swap_bytes);
      }
      return point;
    });
  });
  double far = 1;  // m
  for (int axis = 0; axis < 3; ++axis)
    if (xyz[static_cast<std::size_t>(axis)].type == Scalar::float32)
      far = std::max(far, std::fabs(read.shift[axis]));
  constexpr int float_digits = std::numeric_limits<float>::digits;
  constexpr double usual_noise_m = 0.01;  // of a reading
  const double step = std::ldexp(1.0, std::ilogb(far) + 1 - float_digits);
  if (step > usual_noise_m)
    fail_reading(formatted(
        "its coordinates, %.0f m from 0, are multiples of %.2g m, as they are float32: write them as double",
        far, step));
  return read;
}

Cloud text_points(Lines& lines, const Coordinates& xyz, std::size_t points, std::size_t columns,
                  const std::filesystem::path& file) {
  std::vector<Eigen::Vector3d> result;
  result.reserve(std::min(points, lines.rest().size() / (2 * columns) + 1));  // a digit and a blank a value
  for (std::string_view line; result.size() < points && lines.next(line);) {
    const auto words = words_of(line);
    if (words.empty()) continue;
    if (words.size() != columns)
      throw Error(Error::Kind::data, at_line(file, lines.number()),
                  std::to_string(words.size()) + " values where the header says " + std::to_string(columns),
                  "write the file again");
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[static_cast<int>(axis)] = number(words[xyz[axis].column], file, lines.number());
    result.push_back(point);
  }
  if (result.size() == points)
    return shifted(points, 1, [&](std::size_t, std::size_t i) { return result[i]; });
  throw Error(Error::Kind::data, file.string(),
              "truncated: " + std::to_string(result.size()) + " of " + std::to_string(points) + " points",
              "write the file again");
}

void TimeField::note(std::string_view field, const Field& at) {
  if (place || !is_time_field(field) || size_of(at.type) < 2) return;
  name = field;
  place = at;
}

PointTimes binary_times(std::string_view bytes, const TimeField& time, bool swap_bytes, std::size_t width,
                        std::size_t rows, std::size_t row) {
  if (!time.place) return {};
  PointTimes times{time.name, {}};
  times.values.reserve(width * rows);
  for (std::size_t i = 0; i < width * rows; ++i)
    times.values.push_back(value_of(bytes.substr(i / width * row), *time.place, i % width, swap_bytes));
  return times;
}

PointTimes text_times(Lines rows, const TimeField& time, std::size_t points,
                      const std::filesystem::path& file) {
  if (!time.place) return {};
  PointTimes times{time.name, {}};
  for (std::string_view line; times.values.size() < points && rows.next(line);)
    if (const auto words = words_of(line); !words.empty())
      times.values.push_back(number(words[time.place->column], file, rows.number()));
  return times;
}

Cloud read_velodyne(const std::filesystem::path& file) {
  constexpr std::size_t value = sizeof(float), step = 4 * value;
  const std::string bytes = read_bytes(file, largest_cloud_file);
  const auto refuse = [&](const std::string& what) {
    throw Error(Error::Kind::data, file.string(), what + "not a list of float32 x y z reflectance",
                "it is truncated, or a point takes another number of floats: write a PCD");
  };
  if (bytes.empty() || bytes.size() % step != 0) refuse(bytes.empty() ? "is empty, " : "is ");
  const std::size_t points = bytes.size() / step;
  // Where points take three or five floats, coordinates stand at the place of reflectance.
  std::size_t negative = 0, absurd = 0;
  constexpr float largest_coordinate = 1e8F;  // m: beyond the earth's, as two fifths of random bits are
  for (std::size_t i = 0; i < points; ++i)
    for (std::size_t column = 0; column < 4; ++column) {
      const auto one = number_at<float>(bytes.data() + i * step + column * value, !little_endian_host);
      if (column == 3)
        negative += one < 0 ? 1 : 0;
      else
        absurd += std::fabs(one) > largest_coordinate ? 1 : 0;
    }
  constexpr std::size_t damaged = 10;  // of as many points one may be
  if (damaged * negative > points) refuse(count_of(negative, "reflectance") + " below 0: ");
  if (damaged * absurd > 3 * points) refuse(count_of(absurd, "coordinate") + " larger than the earth: ");
  return binary_points(bytes,
                       {{{0, step, 0, Scalar::float32},
                         {value, step, 0, Scalar::float32},
                         {2 * value, step, 0, Scalar::float32}}},
                       !little_endian_host, points);
}

}  // namespace octosurf::io
