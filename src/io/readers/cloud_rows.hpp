#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::io {

// Common part of PCD and PLY: a header in lines, then rows of values, three of which are used.

/// Splits a text in memory into lines, without line ends, and counts them.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  /// False at the end. Lines are split at '\n'; a '\r' before it is dropped.
  bool next(std::string_view& line);
  std::size_t number() const { return number_; }  ///< of the line read last, from 1
  std::string_view rest() const { return text_; }

 private:
  std::string_view text_;
  std::size_t number_ = 0;
};

constexpr std::size_t largest_step = 1 << 16;  ///< maximum bytes of one point, and so its values

/// Words separated by blanks; at most two more than `largest_step`, more than any header or row may have: a
/// word takes eight times its two bytes in a file.
std::vector<std::string_view> words_of(std::string_view line);

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
