#include "geometry/local_width.hpp"

#include "geometry/median.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace octosurf::geometry {
namespace {

/// Points by square cells, so that neighbours within a cell's edge are in nine of them.
class PointCells {
 public:
  PointCells(std::span<const Eigen::Vector2d> points, double edge) : points_(points), edge_(edge) {
    order_.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) order_.emplace_back(cell_of(points[i], 0, 0), i);
    std::sort(order_.begin(), order_.end());
  }

  template <class Visit>
  void for_each_near(const Eigen::Vector2d& at, Visit&& visit) const {
    for (int row = -1; row <= 1; ++row) {
      auto entry = std::lower_bound(order_.begin(), order_.end(), std::pair(cell_of(at, -1, row), 0U));
      for (const Cell last = cell_of(at, 1, row); entry != order_.end() && entry->first <= last; ++entry)
        visit(points_[entry->second]);
    }
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;  // row, column

  Cell cell_of(const Eigen::Vector2d& p, int columns_off, int rows_off) const {
    const auto at = [this](double coordinate) { return std::llround(coordinate / edge_); };
    return {at(p.y()) + rows_off, at(p.x()) + columns_off};
  }

  std::span<const Eigen::Vector2d> points_;
  double edge_;
  std::vector<std::pair<Cell, std::uint32_t>> order_;
};

/// Of the points within `radius` of one of them.
double width_around(const PointCells& cells, const Eigen::Vector2d& at, double radius) {
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  cells.for_each_near(at, [&](const Eigen::Vector2d& p) {
    const Eigen::Vector2d off = p - at;
    if (off.squaredNorm() > radius * radius) return;
    ++count;
    sum += off;
    squares += off * off.transpose();
  });
  const Eigen::Vector2d mean = sum / count;
  const Eigen::Matrix2d c = squares / count - mean * mean.transpose();
  const double smallest = c.trace() / 2 - std::hypot((c(0, 0) - c(1, 1)) / 2, c(0, 1));
  return std::sqrt(12 * std::max(0.0, smallest));
}

}  // namespace

std::optional<double> median_local_width(std::span<const Eigen::Vector2d> points, double width,
                                         double spacing, std::size_t most) {
  if (points.empty() || width <= spacing) return {};
  constexpr double unknown = std::numeric_limits<double>::infinity();
  const double radius = 1.5 * width;
  const PointCells cells(points, radius);
  const std::size_t stride = (points.size() - 1) / most + 1;
  std::vector<double> widths;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const double around = width_around(cells, points[i], radius);
    widths.push_back(around > spacing ? around : unknown);
  }
  const double median = median_of(widths);
  if (median == unknown) return {};
  return std::hypot(median, spacing);
}

}  // namespace octosurf::geometry
