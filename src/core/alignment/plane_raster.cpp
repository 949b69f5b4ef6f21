#include "alignment/plane_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>

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
  const double coarser = std::sqrt(box.sizes().x() * box.sizes().y() / (most_cells * edge * edge));
  per_edge_ = 1 / (edge * std::max(1.0, coarser));
  corner_ = box.min();
  cells_ = (box.sizes().array() * per_edge_).floor() + 1;
  window_ = window_of(window);
  words_ = static_cast<std::size_t>(window_.size.x()) / 64 + 1;
  std::vector<std::uint64_t> filled(words_ * static_cast<std::size_t>(window_.size.y()));
  fill(polygons, filled);
  erode(filled);
}

/// One cell more on each side, for the erosion.
PlaneRaster::Window PlaneRaster::window_of(const Eigen::AlignedBox2d& box) const {
  const Eigen::Array2d low = ((box.min() - corner_).array() * per_edge_).floor() - 1,
                       high = ((box.max() - corner_).array() * per_edge_).floor() + 2;
  const Eigen::Array2d first = low.max(0.0).min(cells_);
  return {first, (high.min(cells_) - first).max(0.0)};
}

bool PlaneRaster::holds(const Eigen::AlignedBox2d& window) const {
  const Window wanted = window_of(window);
  return (wanted.first >= window_.first).all() &&
         (wanted.first + wanted.size <= window_.first + window_.size).all();
}

/// Even-odd rule at the cells' centres: every side of a ring flips all cells to its right.
void PlaneRaster::fill(const std::vector<Polygon>& polygons, std::vector<std::uint64_t>& bits) const {
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
      set_range(&bits[row * words_], column(at[i]), column(at[i + 1]));
  }
}

void PlaneRaster::erode(const std::vector<std::uint64_t>& filled) {
  const auto rows = static_cast<std::size_t>(window_.size.y());
  std::vector<std::uint64_t> along(filled.size());
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t w = 0; w < words_; ++w) {
      const std::uint64_t* const at = &filled[row * words_ + w];
      const std::uint64_t before = w > 0 ? at[-1] >> 63 : 0;
      const std::uint64_t after = w + 1 < words_ ? at[1] << 63 : 0;
      along[row * words_ + w] = *at & (*at << 1 | before) & (*at >> 1 | after);
    }
  bits_.assign(filled.size(), 0);
  for (std::size_t row = 1; row + 1 < rows; ++row)
    for (std::size_t w = 0; w < words_; ++w)
      bits_[row * words_ + w] =
          along[(row - 1) * words_ + w] & along[row * words_ + w] & along[(row + 1) * words_ + w];
}

}  // namespace octosurf::alignment
