#include "planning/cell_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include <octosurf/error.hpp>

namespace octosurf::planning {
namespace {

constexpr float unreached = 1e6F;  // cells; its square is a float, too

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
  constexpr std::size_t most_cells = 1 << 28;
  if (cells() > most_cells)
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

Mask CellRaster::within(const std::vector<float>& distances, double radius, bool inclusive) const {
  Mask mask(distances.size());
  // Distances are roots of whole numbers, rounded.
  const auto limit = static_cast<float>(radius + (inclusive ? 1e-3 : -1e-3));
  std::transform(distances.begin(), distances.end(), mask.begin(),
                 [limit](float distance) { return static_cast<std::uint8_t>(distance <= limit); });
  return mask;
}

Mask CellRaster::closed(const Mask& mask, double radius) const {
  Mask outside = within(distance_to(mask), radius, true);
  for (std::uint8_t& cell : outside) cell = cell == 0;
  Mask result = within(distance_to(outside), radius, true);
  for (std::uint8_t& cell : result) cell = cell == 0;
  return result;
}

std::vector<float> CellRaster::depth_in(const Mask& mask) const {
  Mask outside = mask;
  for (std::uint8_t& cell : outside) cell = cell == 0;
  return distance_to(outside);
}

Mask CellRaster::eroded(const Mask& mask, double radius) const {
  Mask core = within(depth_in(mask), radius, false);
  for (std::uint8_t& cell : core) cell = cell == 0;
  return core;
}

Mask CellRaster::opened(const Mask& mask, double radius) const {
  return within(distance_to(eroded(mask, radius)), radius, false);
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

bool CellRaster::any_beside(const Mask& mask, std::size_t cell) const {
  bool any = false;
  for_each_beside(cell, [&](std::size_t i) { any |= mask[i] != 0; });
  return any;
}

std::vector<std::int32_t> CellRaster::summed(const Mask& mask) const {
  const auto width = static_cast<std::size_t>(width_);
  std::vector<std::int32_t> sums(mask.size());
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const std::int32_t left = i % width != 0 ? sums[i - 1] : 0, above = i >= width ? sums[i - width] : 0,
                       both = i % width != 0 && i >= width ? sums[i - width - 1] : 0;
    sums[i] = mask[i] + left + above - both;
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
    const Eigen::Vector2d first = middle(cells[k]);
    std::size_t last = k;
    while (last + 1 < cells.size() && cells[last + 1] == cells[last] + 1 && cells[last + 1] % width != 0)
      ++last;
    const Eigen::Vector2d beside = Eigen::Vector2d::Constant((0.5 + more) * edge_), low = first - beside,
                          high = middle(cells[last]) + beside;
    rings.push_back({low, {high.x(), low.y()}, high, {low.x(), high.y()}});
    k = last + 1;
  }
  return rings;
}

}  // namespace octosurf::planning
