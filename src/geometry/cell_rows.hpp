#pragma once

#include "geometry/cell_bits.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <octosurf/adapters/detail/morton.hpp>

namespace octosurf::geometry {

/// The occupied cells of a plane as rows of bits: which of them lie near one, by their places in the list.
/// Fixed once made. Memory: a bit for every cell between the first and the last of its row.
class CellRows {
 public:
  using Place = std::uint32_t;  ///< in the list of cells

  /// `cells`: by v, then u; each once; at least one.
  explicit CellRows(std::span<const PlaneCell> cells);

  /// visit(first, last) for each row of the cells that are at most `reach` off along either axis, itself
  /// included, v ascending: they stand at [first, last) of the list. O(reach).
  template <class Visit>
  void for_each_run_within(PlaneCell at, int reach, Visit&& visit) const {
    const std::int64_t low = std::max<std::int64_t>(0, std::int64_t{at.v} - reach - first_v_);
    const std::int64_t high = std::min<std::int64_t>(static_cast<std::int64_t>(rows_.size()) - 1,
                                                     std::int64_t{at.v} + reach - first_v_);
    for (std::int64_t v = low; v <= high; ++v) {
      const Row& row = rows_[static_cast<std::size_t>(v)];
      const Place first = rank(row, std::int64_t{at.u} - reach),
                  last = rank(row, std::int64_t{at.u} + reach + 1);
      if (first < last) visit(first, last);
    }
  }

  /// Of each cell, in order of the list. 2: of the 5×5 cells around one at most is empty; 1: none of the 3×3;
  /// else 0.
  std::vector<std::int8_t> depths() const;

 private:
  struct Row {
    std::int32_t word = 0;  // its first bit is that of u = 64·word
    std::uint32_t words = 0;
    std::uint32_t begin = 0;  // of bits_ and before_
    Place cells = 0;          // in the rows before
    Place end = 0;
  };
  /// Where the row's first cell from `u` on stands.
  Place rank(const Row& row, std::int64_t u) const {
    const std::int64_t bit = u - std::int64_t{row.word} * 64;
    if (bit <= 0) return row.cells;
    const auto word = static_cast<std::uint64_t>(bit) / 64;
    if (word >= row.words) return row.end;
    return before_[row.begin + word] +
           detail::bit_count(bits_[row.begin + word] & ((std::uint64_t{1} << (bit % 64)) - 1));
  }
  std::uint64_t bits(std::int64_t row, std::int64_t word) const;

  std::int32_t first_v_ = 0;
  std::vector<Row> rows_;
  std::vector<std::uint64_t> bits_;
  std::vector<Place> before_;  // cells in the list before each word
};

/// Points by the cells they fall into.
struct PointsByCell {
  using Point = std::uint32_t;
  std::vector<PlaneCell> cells;      ///< by v, then u
  std::vector<std::uint32_t> first;  ///< of each cell's points, and the end
  std::vector<Point> points;         ///< those of one cell in the order they came

  /// `cells`: where each of the points falls; at least one. O(n).
  PointsByCell(std::span<const Point> points, std::span<const PlaneCell> cells);

  std::span<const Point> of(std::size_t cell) const {
    return std::span(points).subspan(first[cell], first[cell + 1] - first[cell]);
  }
};

/// The highest of the cells' labels near a cell: a bound, by tiles at least `reach` wide.
class HighestAround {
 public:
  HighestAround(std::span<const PlaneCell> cells, std::span<const std::uint32_t> labels, int reach);

  /// No label within `reach` of the cell, which must be one of them, is higher.
  std::uint32_t operator()(PlaneCell cell) const;

 private:
  PlaneCell tile_of(PlaneCell cell) const { return {cell.u >> shift_, cell.v >> shift_}; }
  std::size_t place_of(PlaneCell tile) const {  // with a margin of one around
    return static_cast<std::size_t>(std::int64_t{tile.v} - low_.v + 1) * width_ +
           static_cast<std::size_t>(std::int64_t{tile.u} - low_.u + 1);
  }

  int shift_ = 0;
  PlaneCell low_;
  std::size_t width_ = 0;
  std::vector<std::uint32_t> highest_;  // none where few cells lie far apart
};

}  // namespace octosurf::geometry
