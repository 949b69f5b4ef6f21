#include "planning/polygon_index.hpp"

#include "geometry/even_odd.hpp"

#include <cmath>

namespace octosurf::planning {

PolygonIndex::PolygonIndex(const std::vector<Polygon>& polygons) {
  for_each_edge(polygons, [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    edges_.emplace_back(from, to);
    box_.extend(from);
  });
  if (!edges_.empty()) sort_into_rows();
}

/// As many rows as edges, but at least as high as the mean edge: an edge spans few rows.
void PolygonIndex::sort_into_rows() {
  double rise = 0;
  for (const auto& [from, to] : edges_) rise += std::fabs(to.y() - from.y());
  const auto n = static_cast<double>(edges_.size());
  const double height = box_.sizes().y();
  const double rows = rise > 0 && height > 0 ? std::clamp(height / (rise / n), 1.0, n) : 1.0;
  rows_per_metre_ = height > 0 ? rows / height : 0;
  row_begin_.assign(static_cast<std::size_t>(rows) + 2, 0);
  const auto each_row = [&](const auto& visit) {
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      const auto [low, high] = std::minmax(edges_[i].first.y(), edges_[i].second.y());
      for (std::size_t row = row_of(low), last = row_of(high); row <= last; ++row) visit(row, i);
    }
  };
  each_row([&](std::size_t row, std::uint32_t) { ++row_begin_[row + 1]; });
  for (std::size_t row = 1; row < row_begin_.size(); ++row) row_begin_[row] += row_begin_[row - 1];
  rows_.resize(row_begin_.back());
  std::vector<std::uint32_t> next(row_begin_.begin(), row_begin_.end() - 1);
  each_row([&](std::size_t row, std::uint32_t i) { rows_[next[row]++] = i; });
}

bool PolygonIndex::contains(const Eigen::Vector2d& point) const {
  if (edges_.empty() || !box_.contains(point)) return false;
  const std::size_t row = row_of(point.y());
  bool inside = false;
  for (std::uint32_t k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
    const auto& [a, b] = edges_[rows_[k]];
    inside ^= geometry::passes_left_of(point, a, b);
  }
  return inside;
}

std::optional<Eigen::Vector2d> PolygonIndex::closest(const Eigen::Vector2d& point, double within) const {
  if (edges_.empty()) return {};
  if (contains(point)) return point;
  std::optional<Eigen::Vector2d> best;
  double least = within * within * (1 + 1e-9);  // rounding must not lose what is just as far
  const auto look = [&](std::size_t row, double off) {
    if (off > 0 && off * off > least) return false;
    for (std::uint32_t k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
      const Eigen::Vector2d at = closest_on_segment(edges_[rows_[k]].first, edges_[rows_[k]].second, point);
      if ((at - point).squaredNorm() >= least) continue;
      least = (at - point).squaredNorm();
      best = at;
    }
    return true;
  };
  // From its row on, to both sides, until rows are farther off.
  const double rows = static_cast<double>(row_begin_.size() - 1), low = box_.min().y(),
               height = rows_per_metre_ > 0 ? 1 / rows_per_metre_ : 0;
  const auto first = static_cast<double>(row_of(point.y()));
  for (double row = first; row < rows && look(static_cast<std::size_t>(row), low + row * height - point.y());)
    ++row;
  for (double row = first;
       row > 0 && look(static_cast<std::size_t>(row - 1), point.y() - low - row * height);)
    --row;
  return best;
}

}  // namespace octosurf::planning
