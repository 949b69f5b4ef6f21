#pragma once

#include "io/readers/bounded_file.hpp"
#include "io/readers/cloud_file.hpp"
#include "io/text_file.hpp"

#include <Eigen/Core>
#include <array>
#include <boost/mp11/algorithm.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace octosurf::io {

// Common part of PCD, PLY, PointCloud2 and velodyne: points as rows of values, some of which are used.

constexpr std::size_t largest_step = 1 << 16;  ///< maximum bytes of one point, and so its values

/// The words of a header or a row: at most a keyword, a word per value, and one too many.
inline std::vector<std::string_view> words_of(std::string_view line) {
  return words_between(" \t\r\v\f", line, largest_step + 2);
}

/// A count in a header; throws Error(data) naming the word.
std::uint32_t count_in_header(std::string_view word, const std::filesystem::path& file);

/// Type of a value, whatever a format calls it.
enum class Scalar { none, int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// Calls `use` with a value of that type; of `none`, with a byte.
template <class Use>
decltype(auto) with_type_of(Scalar type, const Use& use) {
  using Types = std::tuple<std::uint8_t, std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                           std::uint32_t, std::int64_t, std::uint64_t, float, double>;  // in that order
  return boost::mp11::mp_with_index<std::tuple_size_v<Types>>(
      static_cast<std::size_t>(type), [&](auto i) { return use(std::tuple_element_t<i, Types>{}); });
}

inline std::size_t size_of(Scalar type) {
  return with_type_of(type, [](auto value) { return sizeof value; });
}
inline bool is_real(Scalar type) { return type == Scalar::float32 || type == Scalar::float64; }

/// Where a value of each point is.
struct Field {
  std::size_t offset = 0;  ///< bytes from the first point's begin to its value
  std::size_t step = 0;    ///< bytes from one point to the next
  std::size_t column = 0;  ///< of the row, when the values are text
  Scalar type = Scalar::float32;
};
using Coordinates = std::array<Field, 3>;  ///< x, y, z

/// The i-th point's value; it must lie in `bytes`.
inline double value_of(std::string_view bytes, const Field& field, std::size_t i, bool swap_bytes) {
  const char* const place = bytes.data() + field.offset + i * field.step;
  return with_type_of(field.type, [&](auto value) {
    return static_cast<double>(number_at<decltype(value)>(place, swap_bytes));
  });
}

/// From here on float rounds by more than half a millimetre. No sensor reaches so far.
constexpr double farthest_m = 8192;

/// The axis of a field called x, y or z.
inline std::optional<std::size_t> axis_of(std::string_view field) {
  const std::size_t axis = std::string_view("xyz").find(field);
  return field.size() == 1 && axis < 3 ? std::optional(axis) : std::nullopt;
}

/// The points and their shift, in `rows` of `width` points, from one to the next `row` bytes. The caller must
/// ensure that all values lie in `bytes`. Points exactly at 0 become not finite: drivers write them for "no
/// return". Throws std::runtime_error for float32 that is so far from 0 that it rounds by more than a
/// reading's noise.
Cloud binary_points(std::string_view bytes, const Coordinates& xyz, bool swap_bytes, std::size_t width,
                    std::size_t rows = 1, std::size_t row = 0);

/// One point per line of `columns` words. Throws Error(data) with the line for other lines and for missing
/// ones.
Cloud text_points(Lines& lines, const Coordinates& xyz, std::size_t points, std::size_t columns,
                  const std::filesystem::path& file);

/// The first field that is called as drivers call a point's time.
struct TimeField {
  std::string name;
  std::optional<Field> place;

  void note(std::string_view field, const Field& at);
};
/// As binary_points(); empty if there is no such field.
PointTimes binary_times(std::string_view bytes, const TimeField& time, bool swap_bytes, std::size_t width,
                        std::size_t rows = 1, std::size_t row = 0);

/// In rows that text_points() has read.
PointTimes text_times(Lines rows, const TimeField& time, std::size_t points,
                      const std::filesystem::path& file);

}  // namespace octosurf::io
