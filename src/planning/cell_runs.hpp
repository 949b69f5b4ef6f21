#pragma once

#include "planning/cell_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The cells of a plane whose middle is inside of polygons, with their holes or without: of each row, where
/// runs of them begin and end. As many numbers as the outlines are cells long.
class CellRuns {
 public:
  CellRuns(const std::vector<Polygon>& polygons, double edge);

  const Eigen::AlignedBox2d& box() const { return box_; }  ///< m, of the polygons

  /// Marks the cells inside in a raster of the same edge; `filled`: those in holes, too.
  void mark(const CellRaster& raster, bool filled, Mask& mask) const;
  /// Calls `visit(row, from, to)` for the runs of cells inside.
  template <class Visit>
  void for_each_run(const Visit& visit) const {
    for (std::int64_t row = first_row_; row < first_row_ + rows(); ++row) {
      const Turns turns = turns_of(row, inside_);
      for (std::size_t i = 0; i + 1 < turns.size(); i += 2) visit(row, turns[i], turns[i + 1]);
    }
  }
  /// Calls `visit(row, from, to)` for runs of cells that only one of both has, with holes or without.
  template <class Visit>
  void for_each_difference(const CellRuns& other, const Visit& visit) const {
    const std::int64_t first = std::min(first_row_, other.first_row_),
                       last = std::max(first_row_ + rows(), other.first_row_ + other.rows());
    for (std::int64_t row = first; row < last; ++row) {
      compare(row, turns_of(row, inside_), other.turns_of(row, other.inside_), visit);
      compare(row, turns_of(row, filled_), other.turns_of(row, other.filled_), visit);
    }
  }

 private:
  using Turns = std::span<const std::int32_t>;
  struct Rows {
    std::vector<std::size_t> begin{0};  // of each row, and the end
    std::vector<std::int32_t> turns;    // first cell of a run, first one after it, …
  };

  std::int64_t rows() const { return static_cast<std::int64_t>(inside_.begin.size()) - 1; }
  Turns turns_of(std::int64_t row, const Rows& of) const {
    if (row < first_row_ || row >= first_row_ + rows()) return {};
    const auto i = static_cast<std::size_t>(row - first_row_);
    return {of.turns.data() + of.begin[i], of.turns.data() + of.begin[i + 1]};
  }
  /// Where only one of both turns, they begin or cease to differ.
  template <class Visit>
  static void compare(std::int64_t row, const Turns& a, const Turns& b, const Visit& visit) {
    if (std::equal(a.begin(), a.end(), b.begin(), b.end())) return;
    std::int64_t from = 0;
    bool differ = false;
    for (std::size_t i = 0, k = 0; i < a.size() || k < b.size();) {
      const std::int32_t at = k == b.size() || (i < a.size() && a[i] < b[k]) ? a[i] : b[k];
      const bool in_a = i < a.size() && a[i] == at, in_b = k < b.size() && b[k] == at;
      i += in_a ? 1 : 0;
      k += in_b ? 1 : 0;
      if (in_a == in_b) continue;
      if (differ) visit(row, from, std::int64_t{at});
      differ = !differ;
      from = at;
    }
  }

  Eigen::AlignedBox2d box_;
  std::int64_t first_row_ = 0;
  Rows inside_, filled_;
};

}  // namespace octosurf::planning
