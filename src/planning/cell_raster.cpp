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
void transform(std::vector<float>& f, std::vector<float>& out, std::vector<int>& at,
               std::vector<float>& from) {
  const int n = static_cast<int>(f.size());
  const auto value = [&f](int i) {
    return f[static_cast<std::size_t>(i)] + static_cast<float>(i) * static_cast<float>(i);
  };
  int last = 0;
  at[0] = 0;
  from[0] = -std::numeric_limits<float>::infinity();
  for (int q = 1; q < n; ++q) {
    float s = 0;
    for (;; --last) {
      const int p = at[static_cast<std::size_t>(last)];
      s = (value(q) - value(p)) / static_cast<float>(2 * (q - p));
      if (s > from[static_cast<std::size_t>(last)]) break;
    }
    ++last;
    at[static_cast<std::size_t>(last)] = q;
    from[static_cast<std::size_t>(last)] = s;
  }
  for (int q = 0, k = 0; q < n; ++q) {
    while (k < last && from[static_cast<std::size_t>(k) + 1] < static_cast<float>(q)) ++k;
    const int p = at[static_cast<std::size_t>(k)];
    out[static_cast<std::size_t>(q)] =
        f[static_cast<std::size_t>(p)] + static_cast<float>(q - p) * static_cast<float>(q - p);
  }
}

}  // namespace

CellRaster::CellRaster(const Eigen::Vector2i& low, const Eigen::Vector2i& high, double edge)
    : edge_(edge), x0_(low.x()), y0_(low.y()), width_(high.x() - low.x()), height_(high.y() - low.y()) {
  if (cells() > std::size_t{1} << 28)
    throw Error(Error::Kind::usage, "gaps", "a surface has more than 2^28 cells of a voxel's edge");
}

Eigen::AlignedBox2d CellRaster::box() const {
  return {edge_ * Eigen::Vector2d(x0_, y0_), edge_ * Eigen::Vector2d(x0_ + width_, y0_ + height_)};
}

Eigen::Vector2d CellRaster::middle(std::size_t cell) const {
  const auto width = static_cast<std::size_t>(width_);
  return edge_ * Eigen::Vector2d(x0_ + static_cast<double>(cell % width) + 0.5,
                                 y0_ + static_cast<double>(cell / width) + 0.5);
}

std::vector<float> CellRaster::distance_to(const Mask& mask) const {
  std::vector<float> squared(mask.size());
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  const std::size_t longest = std::max(width, height);
  std::vector<float> line, out(longest), from(longest + 1);
  std::vector<int> at(longest + 1);
  // Columns in two passes, as between flags distances along a line are counts.
  for (std::size_t x = 0; x < width; ++x) {
    float steps = unreached;
    for (std::size_t y = 0; y < height; ++y)
      squared[y * width + x] = steps = mask[y * width + x] != 0 ? 0 : std::min(unreached, steps + 1);
    steps = unreached;
    for (std::size_t y = height; y-- > 0;) {
      steps = mask[y * width + x] != 0 ? 0 : std::min(unreached, steps + 1);
      squared[y * width + x] = std::min(squared[y * width + x], steps);
    }
  }
  line.resize(width);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) line[x] = squared[y * width + x] * squared[y * width + x];
    transform(line, out, at, from);
    for (std::size_t x = 0; x < width; ++x) squared[y * width + x] = std::sqrt(out[x]);
  }
  return squared;
}

Mask CellRaster::near(const Mask& mask, double radius) const { return covered(mask, radius + 2 * touching); }

Mask CellRaster::covered(const Mask& mask, double radius) const {
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  // Along rows, to the nearest marked one.
  std::vector<std::uint16_t> steps(mask.size());
  for (std::size_t first = 0; first < mask.size(); first += width) {
    std::uint16_t from = UINT16_MAX / 2;
    for (std::size_t x = 0; x < width; ++x)
      steps[first + x] = from = mask[first + x] != 0 ? 0 : std::min<std::uint16_t>(UINT16_MAX / 2, from + 1);
    for (std::size_t x = width; x-- > 0;)
      steps[first + x] = from = std::min<std::uint16_t>(steps[first + x], from + 1);
  }
  Mask found(mask.size(), 0);
  radius -= touching;
  for (std::size_t off = 0; off < height && static_cast<double>(off) < radius; ++off) {
    const double half = std::sqrt(radius * radius - static_cast<double>(off * off));
    const auto beyond = static_cast<std::uint16_t>(std::ceil(half));
    const auto shift = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = 0; i < (height - off) * width; ++i) found[to + i] |= steps[from + i] < beyond;
    };
    shift(0, off * width);
    shift(off * width, 0);
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
  const auto width = static_cast<std::size_t>(width_);
  for (std::size_t y = 0; y + 1 < static_cast<std::size_t>(height_); ++y)
    for (std::size_t x = 0; x + 1 < width; ++x) {
      const std::size_t i = y * width + x;
      if ((mask[i] & mask[i + 1] & mask[i + width] & mask[i + width + 1]) != 0)
        result[i] = result[i + 1] = result[i + width] = result[i + width + 1] = 1;
    }
  return result;
}

std::vector<std::int32_t> CellRaster::summed(const Mask& mask) const {
  const auto width = static_cast<std::size_t>(width_);
  std::vector<std::int32_t> sums(mask.size());
  for (std::size_t first = 0; first < mask.size(); first += width) {
    std::int32_t row = 0;
    for (std::size_t i = first; i < first + width; ++i)
      sums[i] = (row += mask[i]) + (first > 0 ? sums[i - width] : 0);
  }
  return sums;
}

std::int32_t CellRaster::sum(const std::vector<std::int32_t>& sums, std::size_t cell, int around) const {
  const int x = static_cast<int>(cell % static_cast<std::size_t>(width_)),
            y = static_cast<int>(cell / static_cast<std::size_t>(width_));
  const auto before = [&](int column, int row) {  // both included
    if (column < 0 || row < 0) return std::int32_t{0};
    return sums[static_cast<std::size_t>(std::min(row, height_ - 1)) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(std::min(column, width_ - 1))];
  };
  const int left = x - around - 1, right = x + around, low = y - around - 1, high = y + around;
  return before(right, high) - before(left, high) - before(right, low) + before(left, low);
}

std::vector<std::size_t> CellRaster::marked(const Mask& mask) const {
  std::vector<std::size_t> cells;
  for (std::size_t i = 0; i < mask.size(); ++i)
    if (mask[i] != 0) cells.push_back(i);
  return cells;
}

std::vector<Ring2> CellRaster::rows(const std::vector<std::size_t>& cells, int more) const {
  std::vector<Ring2> rings;
  const auto width = static_cast<std::size_t>(width_);
  for (std::size_t k = 0; k < cells.size();) {
    std::size_t last = k;
    while (last + 1 < cells.size() && cells[last + 1] == cells[last] + 1 && cells[last + 1] % width != 0)
      ++last;
    rings.push_back(
        ring_of(box_about(Eigen::AlignedBox2d(middle(cells[k]), middle(cells[last])), (0.5 + more) * edge_)));
    k = last + 1;
  }
  return rings;
}

}  // namespace octosurf::planning
