#include "geometry/local_width.hpp"

#include "geometry/median.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace octosurf::geometry {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Points by square cells, so that neighbours within a cell's edge are in nine of them.
class PointCells {
 public:
  PointCells(std::span<const Eigen::Vector2d> points, std::span<const Eigen::Vector2d> spread, double edge)
      : points_(points), spread_(spread), edge_(edge) {
    order_.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) order_.emplace_back(cell_of(points[i], 0, 0), i);
    std::sort(order_.begin(), order_.end());
  }

  /// Of the points within a cell's edge of point i, and no farther from it along `axis` than `along`.
  Eigen::Matrix2d covariance_around(std::size_t i, const Eigen::Vector2d& axis, double along) const {
    double count = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    for (int row = -1; row <= 1; ++row) {
      auto entry =
          std::lower_bound(order_.begin(), order_.end(), std::pair(cell_of(points_[i], -1, row), 0U));
      for (const Cell last = cell_of(points_[i], 1, row); entry != order_.end() && entry->first <= last;
           ++entry) {
        const std::uint32_t j = entry->second;
        const Eigen::Vector2d off = points_[j] - points_[i];
        if (off.squaredNorm() > edge_ * edge_ || std::fabs(off.dot(axis)) > along) continue;
        ++count;
        sum += off;
        squares += off * off.transpose();
        if (!spread_.empty()) squares -= spread_[j] * spread_[j].transpose() / 3;
      }
    }
    const Eigen::Vector2d mean = sum / count;
    return squares / count - mean * mean.transpose();
  }

 private:
  using Cell = std::pair<std::int64_t, std::int64_t>;  // row, column

  Cell cell_of(const Eigen::Vector2d& p, int columns_off, int rows_off) const {
    const auto at = [this](double coordinate) { return std::llround(coordinate / edge_); };
    return {at(p.y()) + rows_off, at(p.x()) + columns_off};
  }

  std::span<const Eigen::Vector2d> points_, spread_;
  double edge_;
  std::vector<std::pair<Cell, std::uint32_t>> order_;
};

double width_around(const PointCells& cells, std::size_t i, double along) {
  const Eigen::Matrix2d c = cells.covariance_around(i, {0, 0}, infinity);
  const double difference = (c(0, 0) - c(1, 1)) / 2;
  double variance = c.trace() / 2 - std::hypot(difference, c(0, 1));
  if (along < infinity) {
    const double angle = std::atan2(c(0, 1), difference) / 2;
    const Eigen::Vector2d axis(std::cos(angle), std::sin(angle)), across(-axis.y(), axis.x());
    variance = across.dot(cells.covariance_around(i, axis, along) * across);
  }
  return std::sqrt(12 * std::max(0.0, variance));
}

}  // namespace

std::optional<double> median_local_width(std::span<const Eigen::Vector2d> points, double width,
                                         double spacing, std::size_t most,
                                         std::span<const Eigen::Vector2d> spread, double along) {
  if (points.empty() || width <= spacing) return {};
  const PointCells cells(points, spread, 1.5 * width);
  const std::size_t stride = (points.size() - 1) / most + 1;
  std::vector<double> widths;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const double around = width_around(cells, i, along);
    widths.push_back(around > spacing ? around : infinity);
  }
  const double median = median_of(widths);
  if (median == infinity) return {};
  return std::hypot(median, spacing);
}

}  // namespace octosurf::geometry
