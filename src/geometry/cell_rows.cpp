#include "geometry/cell_rows.hpp"

#include <array>
#include <bit>
#include <numeric>
#include <utility>

namespace octosurf::geometry {
namespace {

struct Bounds {
  PlaneCell low, high;

  explicit Bounds(std::span<const PlaneCell> cells) : low(cells.front()), high(low) {
    for (const PlaneCell cell : cells) {
      low = {std::min(low.u, cell.u), std::min(low.v, cell.v)};
      high = {std::max(high.u, cell.u), std::max(high.v, cell.v)};
    }
  }
  std::uint64_t width() const { return static_cast<std::uint64_t>(std::int64_t{high.u} - low.u) + 1; }
  std::uint64_t height() const { return static_cast<std::uint64_t>(std::int64_t{high.v} - low.v) + 1; }
};

struct Placed {
  std::uint64_t cell;
  PointsByCell::Point point;
};

/// Stable. O(n) for every eleven bits of `largest`.
void sort_by_cell(std::vector<Placed>& placed, std::uint64_t largest) {
  constexpr unsigned digits = 11;
  constexpr std::uint64_t mask = (1U << digits) - 1;
  std::vector<Placed> sorted(placed.size());
  for (unsigned shift = 0; shift < 64 && largest >> shift != 0; shift += digits) {
    std::array<std::uint32_t, mask + 2> begin{};
    for (const Placed& p : placed) ++begin[(p.cell >> shift & mask) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const Placed& p : placed) sorted[begin[p.cell >> shift & mask]++] = p;
    placed.swap(sorted);
  }
}

}  // namespace

CellRows::CellRows(std::span<const PlaneCell> cells) : first_v_(cells.front().v) {
  rows_.resize(static_cast<std::size_t>(std::int64_t{cells.back().v} - first_v_) + 1);
  for (std::size_t first = 0, last; first < cells.size(); first = last) {
    last = first;
    while (last < cells.size() && cells[last].v == cells[first].v) ++last;
    Row& row = rows_[static_cast<std::size_t>(std::int64_t{cells[first].v} - first_v_)];
    row.word = cells[first].u >> 6;
    row.words = static_cast<std::uint32_t>((cells[last - 1].u >> 6) - row.word) + 1;
    row.begin = static_cast<std::uint32_t>(bits_.size());
    row.cells = static_cast<Place>(first);
    row.end = static_cast<Place>(last);
    bits_.resize(bits_.size() + row.words);
    for (std::size_t c = first; c < last; ++c)
      bits_[row.begin + static_cast<std::uint32_t>((cells[c].u >> 6) - row.word)] |= std::uint64_t{1}
                                                                                     << (cells[c].u & 63);
    Place before = row.cells;
    for (std::uint32_t word = row.begin; word < bits_.size(); ++word) {
      before_.push_back(before);
      before += detail::bit_count(bits_[word]);
    }
  }
}

std::uint64_t CellRows::bits(std::int64_t v, std::int64_t word) const {
  if (v < 0 || v >= static_cast<std::int64_t>(rows_.size())) return 0;
  const Row& row = rows_[static_cast<std::size_t>(v)];
  const std::int64_t at = word - row.word;
  return at >= 0 && at < row.words ? bits_[row.begin + static_cast<std::uint64_t>(at)] : 0;
}

std::vector<std::int8_t> CellRows::depths() const {
  std::vector<std::int8_t> depths;
  depths.reserve(rows_.back().end);
  for (std::int64_t v = 0; v < static_cast<std::int64_t>(rows_.size()); ++v) {
    const Row& row = rows_[static_cast<std::size_t>(v)];
    for (std::int64_t word = row.word; word < std::int64_t{row.word} + row.words; ++word) {
      std::uint64_t full = ~std::uint64_t{0};       // none of the 3×3 around is empty
      std::uint64_t missing = 0, more_missing = 0;  // of the 5×5: one and more, two and more
      for (std::int64_t dv = -2; dv <= 2; ++dv) {
        const std::uint64_t left = bits(v + dv, word - 1), here = bits(v + dv, word),
                            right = bits(v + dv, word + 1);
        const std::array<std::uint64_t, 5> shifted{here << 2 | left >> 62, here << 1 | left >> 63, here,
                                                   here >> 1 | right << 63, here >> 2 | right << 62};
        for (const std::uint64_t occupied : shifted) {
          more_missing |= missing & ~occupied;
          missing |= ~occupied;
        }
        if (dv >= -1 && dv <= 1) full &= shifted[1] & shifted[2] & shifted[3];
      }
      for (std::uint64_t cells = bits(v, word); cells != 0; cells &= cells - 1) {
        const int bit = std::countr_zero(cells);
        const bool whole = full >> bit & 1, nearly_whole = !(more_missing >> bit & 1);
        depths.push_back(static_cast<std::int8_t>(!whole ? 0 : nearly_whole ? 2 : 1));
      }
    }
  }
  return depths;
}

PointsByCell::PointsByCell(std::span<const Point> all, std::span<const PlaneCell> cells_of_points) {
  const Bounds bounds(cells_of_points);
  const std::uint64_t width = bounds.width();
  std::vector<Placed> placed;
  placed.reserve(all.size());
  for (std::size_t k = 0; k < all.size(); ++k) {
    const PlaneCell at = cells_of_points[k];
    placed.push_back({static_cast<std::uint64_t>(std::int64_t{at.v} - bounds.low.v) * width +
                          static_cast<std::uint64_t>(std::int64_t{at.u} - bounds.low.u),
                      all[k]});
  }
  sort_by_cell(placed, width * bounds.height() - 1);
  points.reserve(all.size());
  for (const Placed& p : placed) {
    if (points.empty() || p.cell != placed[points.size() - 1].cell) {
      first.push_back(static_cast<std::uint32_t>(points.size()));
      cells.push_back({static_cast<std::int32_t>(bounds.low.u + static_cast<std::int64_t>(p.cell % width)),
                       static_cast<std::int32_t>(bounds.low.v + static_cast<std::int64_t>(p.cell / width))});
    }
    points.push_back(p.point);
  }
  first.push_back(static_cast<std::uint32_t>(points.size()));
}

HighestAround::HighestAround(std::span<const PlaneCell> cells, std::span<const std::uint32_t> labels,
                             int reach) {
  while (1 << shift_ < reach) ++shift_;
  const Bounds bounds(cells);
  low_ = tile_of(bounds.low);
  const PlaneCell high = tile_of(bounds.high);
  width_ = static_cast<std::size_t>(std::int64_t{high.u} - low_.u) + 3;
  const std::size_t height = static_cast<std::size_t>(std::int64_t{high.v} - low_.v) + 3;
  if (width_ * height > 4 * cells.size() + 64) return;
  highest_.resize(width_ * height);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    std::uint32_t& highest = highest_[place_of(tile_of(cells[c]))];
    highest = std::max(highest, labels[c]);
  }
}

std::uint32_t HighestAround::operator()(PlaneCell cell) const {
  if (highest_.empty()) return ~std::uint32_t{0};
  const std::size_t middle = place_of(tile_of(cell));
  std::uint32_t highest = 0;
  for (const std::size_t row : {middle - width_, middle, middle + width_})
    highest = std::max({highest, highest_[row - 1], highest_[row], highest_[row + 1]});
  return highest;
}

}  // namespace octosurf::geometry
