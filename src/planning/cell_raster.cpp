#include "planning/cell_raster.hpp"

#include "planning/rings.hpp"

#include <Eigen/Geometry>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::planning {
namespace {

constexpr float unreached = 1e6F;  // cells; its square is a float, too
// Cells: less than distances, roots of whole numbers, differ near any radius in use.
constexpr double touching = 1e-3;

Mask inverse(Mask mask) {
  for (std::uint8_t& cell : mask) cell = cell == 0;
  return mask;
}

/// Squared distances along one line: the lower envelope of parabolas (Felzenszwalb and Huttenlocher 2012).
void transform(const float* f, int n, float* out, int* at, float* from) {
  const auto square = [](int i) { return static_cast<float>(i) * static_cast<float>(i); };
  int last = 0;
  at[0] = 0;
  from[0] = -std::numeric_limits<float>::infinity();
  for (int q = 1; q < n; ++q) {
    float s = 0;
    for (;; --last) {
      const int p = at[last];
      s = (f[q] + square(q) - (f[p] + square(p))) / static_cast<float>(2 * (q - p));
      if (s > from[last]) break;
    }
    at[++last] = q;
    from[last] = s;
  }
  for (int q = 0, k = 0; q < n; ++q) {
    while (k < last && from[k + 1] < static_cast<float>(q)) ++k;
    out[q] = f[at[k]] + square(q - at[k]);
  }
}

}  // namespace

CellRaster::CellRaster(const Eigen::Vector2i& low, const Eigen::Vector2i& high, double edge)
    : edge_(edge), low_(low), size_(high - low) {
  if (cells() > std::size_t{1} << 28)
    throw Error(Error::Kind::usage, "gaps", "a surface has more than 2^28 cells of a voxel's edge");
}

std::vector<float> CellRaster::distance_to(const Mask& mask) const {
  std::vector<float> squared(mask.size()), line(width()), out(width()), from(width() + 1);
  std::vector<int> at(width() + 1);
  // Columns in two passes, as between flags distances along a line are counts.
  for (std::size_t x = 0; x < width(); ++x) {
    float steps = unreached;
    for (std::size_t i = x; i < mask.size(); i += width())
      squared[i] = steps = mask[i] != 0 ? 0 : std::min(unreached, steps + 1);
    steps = unreached;
    for (std::size_t i = mask.size() + x; i > x;) {
      i -= width();
      steps = mask[i] != 0 ? 0 : std::min(unreached, steps + 1);
      squared[i] = std::min(squared[i], steps);
    }
  }
  for (std::size_t first = 0; first < mask.size(); first += width()) {
    for (std::size_t x = 0; x < width(); ++x) line[x] = squared[first + x] * squared[first + x];
    transform(line.data(), size_.x(), out.data(), at.data(), from.data());
    for (std::size_t x = 0; x < width(); ++x) squared[first + x] = std::sqrt(out[x]);
  }
  return squared;
}

Mask CellRaster::near(const Mask& mask, double radius) const { return covered(mask, radius + 2 * touching); }

Mask CellRaster::covered(const Mask& mask, double radius) const {
  // Along rows, to the nearest marked one.
  std::vector<std::uint16_t> steps(mask.size());
  for (std::size_t first = 0; first < mask.size(); first += width()) {
    std::uint16_t from = UINT16_MAX / 2;
    for (std::size_t i = first; i < first + width(); ++i)
      steps[i] = from = mask[i] != 0 ? 0 : std::min<std::uint16_t>(UINT16_MAX / 2, from + 1);
    for (std::size_t i = first + width(); i-- > first;)
      steps[i] = from = std::min<std::uint16_t>(steps[i], from + 1);
  }
  Mask found(mask.size(), 0);
  radius -= touching;
  for (int off = 0; off < std::min<double>(size_.y(), radius); ++off) {
    const auto beyond = static_cast<std::uint16_t>(std::ceil(std::sqrt(radius * radius - off * off)));
    const std::size_t rows = width() * static_cast<std::size_t>(off), count = mask.size() - rows;
    const auto shift = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = 0; i < count; ++i) found[to + i] |= steps[from + i] < beyond;
    };
    shift(0, rows);
    shift(rows, 0);
  }
  return found;
}

Mask CellRaster::closed(const Mask& mask, double radius) const {
  return inverse(near(inverse(near(mask, radius)), radius));
}

std::vector<float> CellRaster::depth_in(const Mask& mask) const { return distance_to(inverse(mask)); }

Mask CellRaster::eroded(const Mask& mask, double radius) const {
  return inverse(covered(inverse(mask), radius));
}

Mask CellRaster::opened(const Mask& mask, double radius) const {
  return covered(eroded(mask, radius), radius);
}

Mask CellRaster::two_wide(const Mask& mask) const {
  Mask result(mask.size(), 0);
  for (std::size_t i = 0; i + width() + 1 < mask.size(); ++i)
    if (i % width() + 1 < width() && (mask[i] & mask[i + 1] & mask[i + width()] & mask[i + width() + 1]) != 0)
      result[i] = result[i + 1] = result[i + width()] = result[i + width() + 1] = 1;
  return result;
}

std::vector<std::int32_t> CellRaster::summed(const Mask& mask) const {
  std::vector<std::int32_t> sums(mask.size());
  const std::size_t width = this->width();
  for (std::size_t first = 0; first < mask.size(); first += width) {
    std::int32_t row = 0;
    for (std::size_t i = first; i < first + width; ++i)
      sums[i] = (row += mask[i]) + (first > 0 ? sums[i - width] : 0);
  }
  return sums;
}

std::int32_t CellRaster::sum(const std::vector<std::int32_t>& sums, std::size_t cell, int around) const {
  const Eigen::Vector2i at = place_of(cell), before = at.array() - around - 1,
                        last = (at.array() + around).min(high().array() - 1);
  const auto to = [&](int x, int y) {  // both included
    return x < low_.x() || y < low_.y() ? 0 : sums[index_of({x, y})];
  };
  return to(last.x(), last.y()) - to(before.x(), last.y()) - to(last.x(), before.y()) +
         to(before.x(), before.y());
}

std::vector<std::size_t> CellRaster::marked(const Mask& mask) const {
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] != 0) cells.push_back(i);
  return cells;
}

std::vector<Ring2> CellRaster::rows(const std::vector<std::size_t>& cells, int more) const {
  std::vector<Ring2> rings;
  for (std::size_t k = 0; k < cells.size();) {
    std::size_t last = k;
    while (last + 1 < cells.size() && cells[last + 1] == cells[last] + 1 && cells[last + 1] % width() != 0)
      ++last;
    rings.push_back(
        ring_of(box_about(Eigen::AlignedBox2d(middle(cells[k]), middle(cells[last])), (0.5 + more) * edge_)));
    k = last + 1;
  }
  return rings;
}

}  // namespace octosurf::planning
