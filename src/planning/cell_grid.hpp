#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace octosurf::planning {

/// Numbers binned by the cells of a grid over a box.
class CellGrid {
 public:
  CellGrid(const Eigen::AlignedBox2d& box, double cell)
      : low_(box.min()),
        per_metre_(1 / cell),
        columns_(index(box.max().x() - low_.x()) + 1),
        rows_(index(box.max().y() - low_.y()) + 1) {}

  void add(std::uint32_t number, const Eigen::AlignedBox2d& box) {
    for_each_cell(box,
                  [&](std::size_t cell) { entries_.emplace_back(static_cast<std::uint32_t>(cell), number); });
  }

  /// Adds to the cells that a segment passes.
  void add(std::uint32_t number, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const double low = std::min(a.y(), b.y()), high = std::max(a.y(), b.y());
    for (std::size_t row = row_of(low), last = row_of(high); row <= last; ++row) {
      const double from = std::clamp(low_.y() + static_cast<double>(row) / per_metre_, low, high);
      const double to = std::clamp(low_.y() + static_cast<double>(row + 1) / per_metre_, low, high);
      const auto at = [&](double v) {
        return high > low ? a.x() + (v - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) : a.x();
      };
      const double u = high > low ? at(from) : a.x(), w = high > low ? at(to) : b.x();
      // Margin for rounding across a cell's border.
      const double hair = 1e-9;
      for (std::size_t c = column_of(std::min(u, w) - hair); c <= column_of(std::max(u, w) + hair); ++c)
        entries_.emplace_back(static_cast<std::uint32_t>(row * columns_ + c), number);
    }
  }

  void finish() {
    begin_.assign(columns_ * rows_ + 1, 0);
    for (const auto& [cell, number] : entries_) ++begin_[cell + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    numbers_.resize(entries_.size());
    std::vector<std::uint32_t> end(begin_.begin(), begin_.end() - 1);
    for (const auto& [cell, number] : entries_) numbers_[end[cell]++] = number;
    entries_ = {};
  }

  /// Calls visit(number) for all in the cells that a box meets, repeatedly for those in several cells.
  template <typename Visit>
  void visit(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    for_each_cell(box, [&](std::size_t cell) {
      for (std::uint32_t i = begin_[cell]; i < begin_[cell + 1]; ++i) visit(numbers_[i]);
    });
  }

 private:
  std::size_t index(double distance) const {
    return static_cast<std::size_t>(std::max(0.0, std::floor(distance * per_metre_)));
  }
  std::size_t column_of(double u) const { return std::min(index(u - low_.x()), columns_ - 1); }
  std::size_t row_of(double v) const { return std::min(index(v - low_.y()), rows_ - 1); }

  template <typename Visit>
  void for_each_cell(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    const std::size_t first = column_of(box.min().x()), last = column_of(box.max().x());
    for (std::size_t row = row_of(box.min().y()), end = row_of(box.max().y()); row <= end; ++row)
      for (std::size_t column = first; column <= last; ++column) visit(row * columns_ + column);
  }

  Eigen::Vector2d low_;
  double per_metre_;
  std::size_t columns_, rows_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> entries_;  // cell and number, until finish()
  std::vector<std::uint32_t> begin_, numbers_;
};

}  // namespace octosurf::planning
