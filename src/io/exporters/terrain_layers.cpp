#include "io/exporters/terrain_layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace octosurf::io {
namespace {

using Index = Eigen::Index;

struct GridCell {
  Index row, column;
};

template <class Visit>
void for_each_neighbour(const Eigen::MatrixXf& grid, GridCell at, const Visit& visit) {
  if (at.row > 0) visit(GridCell{at.row - 1, at.column});
  if (at.row + 1 < grid.rows()) visit(GridCell{at.row + 1, at.column});
  if (at.column > 0) visit(GridCell{at.row, at.column - 1});
  if (at.column + 1 < grid.cols()) visit(GridCell{at.row, at.column + 1});
}

/// Means over the rows' windows of 2 · `reach` + 1 cells.
Eigen::MatrixXf mean_along_columns(const Eigen::MatrixXf& heights, Index reach) {
  Eigen::MatrixXf mean(heights.rows(), heights.cols());
  for (Index column = 0; column < heights.cols(); ++column) {
    std::vector<double> sums(static_cast<std::size_t>(heights.rows()) + 1, 0);  // up to each row
    for (Index row = 0; row < heights.rows(); ++row)
      sums[static_cast<std::size_t>(row) + 1] =
          sums[static_cast<std::size_t>(row)] + static_cast<double>(heights(row, column));
    for (Index row = 0; row < heights.rows(); ++row) {
      const Index from = std::max<Index>(row - reach, 0), to = std::min(row + reach + 1, heights.rows());
      mean(row, column) =
          static_cast<float>((sums[static_cast<std::size_t>(to)] - sums[static_cast<std::size_t>(from)]) /
                             static_cast<double>(to - from));
    }
  }
  return mean;
}

}  // namespace

Eigen::MatrixXf without_gaps(Eigen::MatrixXf heights) {
  constexpr float none = std::numeric_limits<float>::infinity();
  const Eigen::MatrixXf given = heights;
  std::vector<GridCell> gap;
  for (Index column = 0; column < given.cols(); ++column)
    for (Index row = 0; row < given.rows(); ++row) {
      if (!std::isnan(heights(row, column))) continue;
      float lowest = none;
      gap.assign(1, {row, column});
      heights(row, column) = 0;  // seen
      for (std::size_t next = 0; next < gap.size(); ++next)
        for_each_neighbour(given, gap[next], [&](GridCell at) {
          if (!std::isnan(given(at.row, at.column))) {
            lowest = std::min(lowest, given(at.row, at.column));
          } else if (std::isnan(heights(at.row, at.column))) {
            heights(at.row, at.column) = 0;
            gap.push_back(at);
          }
        });
      const float fill = lowest == none ? std::numeric_limits<float>::quiet_NaN() : lowest;
      for (const GridCell at : gap) heights(at.row, at.column) = fill;
      if (lowest == none) return heights;  // nothing but a gap
    }
  return heights;
}

Eigen::MatrixXf mean_over(const Eigen::MatrixXf& heights, double cells) {
  const auto reach = static_cast<Index>(std::min(cells / 2, static_cast<double>(heights.size())));
  return mean_along_columns(mean_along_columns(heights, reach).transpose(), reach).transpose();
}

}  // namespace octosurf::io
