#include "alignment/plane_raster.hpp"

#include "surfaces/surface_model.hpp"

#include <algorithm>
#include <functional>

namespace octosurf::alignment {
namespace {

constexpr double most_cells = 1 << 26;  // 8 MiB; cells of larger planes are coarser

template <class Visit>
void for_each_ring(const std::vector<Polygon>& polygons, Visit&& visit) {
  for (const Polygon& polygon : polygons) {
    visit(polygon.outer);
    for (const Ring2& hole : polygon.holes) visit(hole);
  }
}

void set_range(std::uint64_t* row, std::size_t begin, std::size_t end) {
  for (; begin < end && begin % 64 != 0; ++begin) row[begin / 64] ^= std::uint64_t{1} << begin % 64;
  for (; begin + 64 <= end; begin += 64) row[begin / 64] ^= ~std::uint64_t{0};
  for (; begin < end; ++begin) row[begin / 64] ^= std::uint64_t{1} << begin % 64;
}

}  // namespace

PlaneRaster::PlaneRaster(const std::vector<Polygon>& polygons, double edge,
                         const Eigen::AlignedBox2d& window) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : polygons)
    for (const Eigen::Vector2d& vertex : polygon.outer) box.extend(vertex);
  if (box.isEmpty()) return;
  set_grid(box, edge, 0);
  cover(held_ = window_of(window));
  fill(polygons);
  combine_neighbours(std::bit_and());
}

/// Dilation by k cells and erosion by as many close gaps of 2 k cells. Inliers h apart are at most h / edge +
/// 1 cells apart, so k is half of h / edge.
PlaneRaster::PlaneRaster(const surfaces::SurfaceModel& surface, const Eigen::Isometry3d& T_surface_map,
                         double max_hole_size, double edge, const Eigen::AlignedBox2d& window) {
  const Eigen::Affine2d T_surface_cells = surface.T_frame_cells(T_surface_map);
  Eigen::AlignedBox2d box;
  surface.raster().for_each_tile([&](const geometry::CellBits::Cells& cells) {
    const Eigen::AlignedBox2d part = cells.box();
    for (int i = 0; i < 4; ++i)
      box.extend(T_surface_cells * part.corner(static_cast<Eigen::AlignedBox2d::CornerType>(i)));
  });
  if (box.isEmpty()) return;
  const int closing = static_cast<int>(max_hole_size / edge / 2);
  set_grid(box, edge, closing);
  held_ = window_of(window);
  cover(window_of(window, 1 + 2 * closing));
  surface.raster().for_each_tile([&](const geometry::CellBits::Cells& cells) {
    cells.for_each([&](geometry::PlaneCell cell) {
      const Eigen::Array2d at =
          ((T_surface_cells * Eigen::Vector2d(cell.u + 0.5, cell.v + 0.5) - corner_).array() * per_edge_)
              .floor() -
          window_.first;
      if ((at < 0).any() || (at >= window_.size).any()) return;
      const auto column = static_cast<std::size_t>(at.x());
      bits_[static_cast<std::size_t>(at.y()) * words_ + column / 64] |= std::uint64_t{1} << column % 64;
    });
  });
  for (int i = 0; i < closing; ++i) combine_neighbours(std::bit_or());
  for (int i = 0; i <= closing; ++i) combine_neighbours(std::bit_and());
}

/// `beyond`: cells more on each side.
void PlaneRaster::set_grid(const Eigen::AlignedBox2d& box, double edge, int beyond) {
  const double coarser = std::sqrt(box.sizes().x() * box.sizes().y() / (most_cells * edge * edge));
  per_edge_ = 1 / (edge * std::max(1.0, coarser));
  corner_ = box.min().array() - beyond / per_edge_;
  cells_ = (box.sizes().array() * per_edge_).floor() + 1 + 2 * beyond;
}

/// `beyond`: cells more on each side, for the neighbours.
PlaneRaster::Window PlaneRaster::window_of(const Eigen::AlignedBox2d& box, int beyond) const {
  const Eigen::Array2d low = ((box.min() - corner_).array() * per_edge_).floor() - beyond,
                       high = ((box.max() - corner_).array() * per_edge_).floor() + 1 + beyond;
  const Eigen::Array2d first = low.max(0.0).min(cells_);
  return {first, (high.min(cells_) - first).max(0.0)};
}

void PlaneRaster::cover(const Window& window) {
  window_ = window;
  words_ = static_cast<std::size_t>(window_.size.x()) / 64 + 1;
  bits_.assign(words_ * static_cast<std::size_t>(window_.size.y()), 0);
}

bool PlaneRaster::holds(const Eigen::AlignedBox2d& window) const {
  const Window wanted = window_of(window);
  return (wanted.first >= held_.first).all() &&
         (wanted.first + wanted.size <= held_.first + held_.size).all();
}

/// Even-odd rule at the cells' centres: every side of a ring flips all cells to its right.
void PlaneRaster::fill(const std::vector<Polygon>& polygons) {
  std::vector<std::vector<double>> crossings(static_cast<std::size_t>(window_.size.y()));
  for_each_ring(polygons, [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      Eigen::Vector2d a = (ring[i] - corner_) * per_edge_;
      Eigen::Vector2d b = (ring[(i + 1) % ring.size()] - corner_) * per_edge_;
      if (a.y() > b.y()) std::swap(a, b);
      // Rows whose centre lies in [a.y, b.y).
      const double first = std::max(window_.first.y(), std::ceil(a.y() - 0.5)),
                   end = window_.first.y() + window_.size.y();
      for (double row = first; row < end && row + 0.5 < b.y(); ++row)
        crossings[static_cast<std::size_t>(row - window_.first.y())].push_back(
            a.x() + (row + 0.5 - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  });
  const auto column = [&](double x) {
    return static_cast<std::size_t>(
        std::clamp(std::ceil(x - 0.5) - window_.first.x(), 0.0, window_.size.x()));
  };
  for (std::size_t row = 0; row < crossings.size(); ++row) {
    std::vector<double>& at = crossings[row];
    std::sort(at.begin(), at.end());
    for (std::size_t i = 0; i + 1 < at.size(); i += 2)
      set_range(&bits_[row * words_], column(at[i]), column(at[i + 1]));
  }
}

/// Each cell with its eight neighbours; beyond the window nothing is set.
template <class Combine>
void PlaneRaster::combine_neighbours(const Combine& combine) {
  const std::size_t rows = bits_.size() / words_;
  std::vector<std::uint64_t> along(bits_.size() +
                                   2 * words_);  // an empty row before the first and after the last
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t w = 0; w < words_; ++w) {
      const std::uint64_t* const at = &bits_[row * words_ + w];
      const std::uint64_t before = w > 0 ? at[-1] >> 63 : 0;
      const std::uint64_t after = w + 1 < words_ ? at[1] << 63 : 0;
      along[(row + 1) * words_ + w] = combine(combine(*at, *at << 1 | before), *at >> 1 | after);
    }
  for (std::size_t i = 0; i < bits_.size(); ++i)
    bits_[i] = combine(combine(along[i], along[i + words_]), along[i + 2 * words_]);
}

}  // namespace octosurf::alignment
