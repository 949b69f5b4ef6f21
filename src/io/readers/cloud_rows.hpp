#pragma once

#include "io/text_file.hpp"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::io {

// Common part of PCD and PLY: a header in lines, then rows of values, three of which are used.

constexpr std::size_t largest_step = 1 << 16;  ///< maximum bytes of one point, and so its values

/// The words of a header or a row: at most a keyword, a word per value, and one too many.
inline std::vector<std::string_view> words_of(std::string_view line) {
  return words_between(" \t\r\v\f", line, largest_step + 2);
}

/// A count in a header; throws Error(data) naming the word.
std::uint32_t count_in_header(std::string_view word, const std::filesystem::path& file);

struct Coordinate {
  std::size_t offset = 0;  ///< bytes from the first point's begin to its value
  std::size_t step = 0;    ///< bytes from one point to the next
  std::size_t column = 0;  ///< of the row, when the values are text
  bool is_double = false;  ///< else float
};
using Coordinates = std::array<Coordinate, 3>;  ///< x, y, z

/// The caller must ensure that all values lie in `bytes`.
std::vector<Eigen::Vector3f> binary_points(std::string_view bytes, const Coordinates& xyz, std::size_t points,
                                           bool swap_bytes);

/// One point per line of `columns` words. Throws Error(data) with the line for other lines and for missing
/// ones.
std::vector<Eigen::Vector3f> text_points(Lines& lines, const Coordinates& xyz, std::size_t points,
                                         std::size_t columns, const std::filesystem::path& file);

/// The point, or not finite if it is exactly at the origin.
Eigen::Vector3f point_or_nothing(const Eigen::Vector3f& point);

}  // namespace octosurf::io
