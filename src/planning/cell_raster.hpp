#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A flag for each cell of a raster, row by row.
using Mask = std::vector<std::uint8_t>;

/// Square cells of a plane about polygons, and morphology with discs on them. Radii in cells;
/// operations with one are O(cells · radius), some ns for each 16 of them.
class CellRaster {
 public:
  /// Cells low … high - 1, counted from the plane's origin. Throws Error(usage) for more than 2²⁸ cells.
  CellRaster(const Eigen::Vector2i& low, const Eigen::Vector2i& high, double edge);

  Eigen::Vector2i low() const { return {x0_, y0_}; }
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t cells() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }
  Eigen::Vector2d middle(std::size_t cell) const;
  /// The cell that holds a point of box().
  std::size_t cell_at(const Eigen::Vector2d& point) const {
    const auto index = [this](double x, int first, int count) {
      return static_cast<std::size_t>(
          std::clamp(static_cast<int>(std::floor(x / edge_)) - first, 0, count - 1));
    };
    return index(point.y(), y0_, height_) * static_cast<std::size_t>(width_) + index(point.x(), x0_, width_);
  }
  /// Calls `visit(cell)` for those whose middle is at most `radius` m from a point.
  template <class Visit>
  void for_each_within(const Eigen::Vector2d& point, double radius, const Visit& visit) const {
    const Eigen::Array2d at = point.array() / edge_ - 0.5 - Eigen::Array2d(x0_, y0_);
    const double reach = radius / edge_;
    const double top = std::min(height_ - 1.0, at.y() + reach),
                 right = std::min(width_ - 1.0, at.x() + reach);
    for (double y = std::max(0.0, std::ceil(at.y() - reach)); y <= top; ++y)
      for (double x = std::max(0.0, std::ceil(at.x() - reach)); x <= right; ++x)
        if (Eigen::Array2d(x - at.x(), y - at.y()).matrix().squaredNorm() <= reach * reach)
          visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
  }

  /// Calls `visit(cell, middle)` for those of a box, row by row.
  template <class Visit>
  void for_each_in(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    if (cells() == 0 || box.isEmpty()) return;
    const auto width = static_cast<std::size_t>(width_);
    const std::size_t low = cell_at(box.min()), high = cell_at(box.max());
    for (std::size_t y = low / width; y <= high / width; ++y)
      for (std::size_t x = low % width; x <= high % width; ++x)
        visit(y * width + x, edge_ * Eigen::Vector2d(x0_ + static_cast<double>(x) + 0.5,
                                                     y0_ + static_cast<double>(y) + 0.5));
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
    const auto width = static_cast<std::size_t>(width_);
    const std::size_t x = cell % width, y = cell / width;
    if (x > 0) visit(cell - 1);
    if (x + 1 < width) visit(cell + 1);
    if (y > 0) visit(cell - width);
    if (y + 1 < static_cast<std::size_t>(height_)) visit(cell + width);
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

  Eigen::AlignedBox2d box() const;                          ///< m, of all cells
  std::vector<std::size_t> marked(const Mask& mask) const;  ///< ascending
  /// Rectangles that cover these cells (ascending), one for each run in a row, enlarged by `more` cells.
  std::vector<Ring2> rows(const std::vector<std::size_t>& cells, int more = 0) const;

 private:
  double edge_;
  int x0_, y0_, width_, height_;
};

}  // namespace octosurf::planning
