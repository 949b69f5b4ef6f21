#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace octosurf::planning {

/// Places by the cells of a grid over a box.
class CellGrid {
 public:
  /// `place_of(number)`: of each of `count`, in the box.
  template <class PlaceOf>
  CellGrid(const Eigen::AlignedBox2d& box, double cell, std::size_t count, const PlaceOf& place_of)
      : low_(box.min()),
        per_metre_(1 / cell),
        columns_(index(box.max().x() - low_.x()) + 1),
        rows_(index(box.max().y() - low_.y()) + 1),
        begin_(columns_ * rows_ + 1, 0),
        numbers_(count) {
    const auto cell_of = [&](std::size_t i) {
      return row_of(place_of(i).y()) * columns_ + column_of(place_of(i).x());
    };
    for (std::size_t i = 0; i < count; ++i) ++begin_[cell_of(i) + 1];
    for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
    std::vector<std::uint32_t> end(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < count; ++i) numbers_[end[cell_of(i)]++] = static_cast<std::uint32_t>(i);
  }

  /// Calls visit(number) for all in the cells that a box meets.
  template <typename Visit>
  void visit(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    const std::size_t first = column_of(box.min().x()), last = column_of(box.max().x());
    for (std::size_t row = row_of(box.min().y()), end = row_of(box.max().y()); row <= end; ++row)
      for (std::uint32_t i = begin_[row * columns_ + first]; i < begin_[row * columns_ + last + 1]; ++i)
        visit(numbers_[i]);
  }

 private:
  std::size_t index(double distance) const {
    return static_cast<std::size_t>(std::max(0.0, std::floor(distance * per_metre_)));
  }
  std::size_t column_of(double u) const { return std::min(index(u - low_.x()), columns_ - 1); }
  std::size_t row_of(double v) const { return std::min(index(v - low_.y()), rows_ - 1); }

  Eigen::Vector2d low_;
  double per_metre_;
  std::size_t columns_, rows_;
  std::vector<std::uint32_t> begin_, numbers_;
};

}  // namespace octosurf::planning
