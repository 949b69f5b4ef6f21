#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A flag for each cell of a raster, row by row.
using Mask = std::vector<std::uint8_t>;

/// Sorts items by cell, and leaves the order within one. Returns the first of each cell, and the end.
template <class Item, class CellOf>
std::vector<std::uint32_t> sort_by_cell(std::vector<Item>& items, std::size_t cells, const CellOf& cell_of) {
  std::vector<std::uint32_t> first(cells + 1, 0);
  for (const Item& item : items) ++first[cell_of(item) + 1];
  for (std::size_t cell = 0; cell < cells; ++cell) first[cell + 1] += first[cell];
  std::vector<Item> sorted(items.size());
  std::vector<std::uint32_t> next = first;
  for (const Item& item : items) sorted[next[cell_of(item)]++] = item;
  items = std::move(sorted);
  return first;
}

/// Square cells of a plane about polygons, and morphology with discs on them. Radii in cells;
/// operations with one are O(cells · radius), some ns for each 16 of them.
class CellRaster {
 public:
  /// Cells low … high - 1, counted from the plane's origin. Throws Error(usage) for more than 2²⁸ cells.
  CellRaster(const Eigen::Vector2i& low, const Eigen::Vector2i& high, double edge);

  const Eigen::Vector2i& low() const { return low_; }
  Eigen::Vector2i high() const { return low_ + size_; }  ///< beyond the last
  const Eigen::Vector2i& size() const { return size_; }
  std::size_t width() const { return static_cast<std::size_t>(size_.x()); }
  std::size_t cells() const { return width() * static_cast<std::size_t>(size_.y()); }
  /// A cell's place, counted from the plane's origin, and the cell at one.
  Eigen::Vector2i place_of(std::size_t cell) const {
    return low_ + Eigen::Vector2i(static_cast<int>(cell % width()), static_cast<int>(cell / width()));
  }
  bool holds(const Eigen::Vector2i& place) const {
    return ((place - low_).array() >= 0).all() && ((place - low_).array() < size_.array()).all();
  }
  std::size_t index_of(const Eigen::Vector2i& place) const {
    return static_cast<std::size_t>(place.y() - low_.y()) * width() +
           static_cast<std::size_t>(place.x() - low_.x());
  }
  Eigen::Vector2d middle(std::size_t cell) const {
    return edge_ * (place_of(cell).cast<double>().array() + 0.5);
  }
  /// The cell that holds a point of box().
  std::size_t cell_at(const Eigen::Vector2d& point) const {
    const Eigen::Array2i at = (point / edge_).array().floor().cast<int>();
    return index_of(at.max(low_.array()).min(high().array() - 1));
  }
  /// Calls `visit(cell)` for those whose middle is at most `radius` m from a point.
  template <class Visit>
  void for_each_within(const Eigen::Vector2d& point, double radius, const Visit& visit) const {
    const Eigen::Array2d at = point.array() / edge_ - 0.5 - low_.array().cast<double>();
    const double reach = radius / edge_;
    const double top = std::min(size_.y() - 1.0, at.y() + reach),
                 right = std::min(size_.x() - 1.0, at.x() + reach);
    for (double y = std::max(0.0, std::ceil(at.y() - reach)); y <= top; ++y)
      for (double x = std::max(0.0, std::ceil(at.x() - reach)); x <= right; ++x)
        if (Eigen::Vector2d(x - at.x(), y - at.y()).squaredNorm() <= reach * reach)
          visit(static_cast<std::size_t>(y) * width() + static_cast<std::size_t>(x));
  }

  /// Calls `visit(cell, middle)` for those of a box, row by row.
  template <class Visit>
  void for_each_in(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    if (cells() == 0 || box.isEmpty()) return;
    const Eigen::Vector2i low = place_of(cell_at(box.min())), high = place_of(cell_at(box.max()));
    for (int y = low.y(); y <= high.y(); ++y)
      for (int x = low.x(); x <= high.x(); ++x)
        visit(index_of({x, y}), edge_ * Eigen::Vector2d(x + 0.5, y + 0.5));
  }

  /// Euclidean distance between middles; large where there is none. O(cells).
  std::vector<float> distance_to(const Mask& mask) const;
  /// Distance of each marked cell to the nearest that is not; 0 elsewhere.
  std::vector<float> depth_in(const Mask& mask) const;
  Mask near(const Mask& mask, double radius) const;     ///< at most `radius` from a marked one
  Mask covered(const Mask& mask, double radius) const;  ///< by discs about marked ones: less than `radius`
  Mask eroded(const Mask& mask, double radius) const;   ///< a disc about it lies within `mask`
  Mask closed(const Mask& mask, double radius) const;   ///< no disc outside `mask` covers it
  Mask opened(const Mask& mask, double radius) const;   ///< some disc within `mask` covers it
  Mask two_wide(const Mask& mask) const;                ///< in a square of 2 × 2 cells of it

  /// Calls `visit(cell)` for the up to four that share a side with one.
  template <class Visit>
  void for_each_beside(std::size_t cell, const Visit& visit) const {
    const std::size_t x = cell % width();
    if (x > 0) visit(cell - 1);
    if (x + 1 < width()) visit(cell + 1);
    if (cell >= width()) visit(cell - width());
    if (cell + width() < cells()) visit(cell + width());
  }
  /// The cells connected with one by their sides; `taken` marks them. `beside` sees what borders
  /// them.
  template <class Member, class Beside>
  std::vector<std::size_t> connected(std::size_t from, Mask& taken, const Member& member,
                                     const Beside& beside) const {
    std::vector<std::size_t> part{from};
    taken[from] = 1;
    for (std::size_t k = 0; k < part.size(); ++k)
      for_each_beside(part[k], [&](std::size_t next) {
        if (!member(next)) return beside(next);
        if (taken[next] != 0) return;
        taken[next] = 1;
        part.push_back(next);
      });
    return part;
  }

  /// Sums over all cells before each in both directions, for sum().
  std::vector<std::int32_t> summed(const Mask& mask) const;
  /// Of the square of 2 `around` + 1 cells about one.
  std::int32_t sum(const std::vector<std::int32_t>& sums, std::size_t cell, int around) const;

  Eigen::AlignedBox2d box() const {  ///< m, of all cells
    return {edge_ * low_.cast<double>(), edge_ * high().cast<double>()};
  }
  std::vector<std::size_t> marked(const Mask& mask) const;  ///< ascending
  /// Rectangles that cover these cells (ascending), one for each run in a row, enlarged by `more` cells.
  std::vector<Ring2> rows(const std::vector<std::size_t>& cells, int more = 0) const;

 private:
  double edge_;
  Eigen::Vector2i low_, size_;
};

}  // namespace octosurf::planning
