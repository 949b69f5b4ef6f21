#include "planning/bit_raster.hpp"

#include "geometry/rings.hpp"
#include "planning/cell_runs.hpp"
#include "planning/rings.hpp"

#include <algorithm>
#include <bit>
#include <boost/container/small_vector.hpp>
#include <cmath>
#include <limits>

namespace octosurf::planning {
namespace {

/// Where a convex polygon lies in each row of cells, in cells: from `low` to `high`.
struct Spans {
  struct Span {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void extend(double x) { low = std::min(low, x), high = std::max(high, x); }
  };
  int first = 0;
  boost::container::small_vector<Span, 64> rows;

  Spans(const Ring2& ring, double edge, double more) {
    const auto row_of = [](double y) { return static_cast<int>(std::floor(y)); };
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Eigen::Vector2d& p : ring) low = std::min(low, p.y()), high = std::max(high, p.y());
    first = row_of(low / edge - more);
    rows.resize(static_cast<std::size_t>(std::max(0, row_of(high / edge + more) - first + 1)));
    for (std::size_t i = 0; i < ring.size(); ++i) {
      Eigen::Vector2d a = ring[i] / edge, b = ring[i + 1 < ring.size() ? i + 1 : 0] / edge;
      if (a.y() > b.y()) std::swap(a, b);
      const double slope = b.y() > a.y() ? (b.x() - a.x()) / (b.y() - a.y()) : 0;
      for (int y = std::max(first, row_of(a.y() - more)), end = first + static_cast<int>(rows.size());
           y < std::min(end, row_of(b.y() + more) + 1); ++y) {
        Span& span = rows[static_cast<std::size_t>(y - first)];
        span.extend(y > a.y() ? a.x() + slope * (std::min<double>(y, b.y()) - a.y()) : a.x());
        span.extend(y + 1 < b.y() ? a.x() + slope * (std::max<double>(y + 1, a.y()) - a.y()) : b.x());
      }
    }
  }
};

/// A corner of a traced ring, in cells.
using Corner = Eigen::Vector2i;

/// The 64 bits of a row from one on; bits beyond its words are those of `beyond`.
std::uint64_t bits_at(const std::uint64_t* row, int words, int from, std::uint64_t beyond = 0) {
  const int first = from >> 6, by = from & 63;
  const auto at = [&](int word) { return word >= 0 && word < words ? row[word] : beyond; };
  return by == 0 ? at(first) : at(first) >> by | at(first + 1) << (64 - by);
}

/// Whether the way from corner `i` to `k` of a ring may be cut short: all corners between lie to the right,
/// by less than a cell. So nothing that is not free comes in: it is a cell away from them at least.
bool can_skip(const std::vector<Corner>& ring, std::size_t i, std::size_t k) {
  const auto way_to = [&](std::size_t corner) -> Eigen::Matrix<std::int64_t, 2, 1> {
    return (ring[corner % ring.size()] - ring[i]).cast<std::int64_t>();
  };
  const auto along = way_to(k);
  const std::int64_t length2 = along.squaredNorm();
  for (std::size_t j = i + 1; j < k; ++j) {
    const auto to = way_to(j);
    const std::int64_t off = along.x() * to.y() - along.y() * to.x(), at = along.dot(to);
    if (off > 0 || off * off >= length2 || at < 0 || at > length2) return false;
  }
  return true;
}

}  // namespace

BitRaster::BitRaster(const Eigen::AlignedBox2d& box, double edge) : edge_(edge) {
  if (box.isEmpty()) return;
  const Eigen::Array2d low = (box.min() / edge).array() + rounding,
                       high = (box.max() / edge).array() - rounding;
  x0_ = static_cast<int>(std::floor(low.x())), y0_ = static_cast<int>(std::floor(low.y()));
  width_ = static_cast<int>(std::ceil(high.x())) - x0_, height_ = static_cast<int>(std::ceil(high.y())) - y0_;
  row_words_ = (width_ + bits - 1) / bits;
  words_.assign(static_cast<std::size_t>(row_words_) * static_cast<std::size_t>(height_), 0);
}

double BitRaster::edge_for(const Surface& surface) {
  constexpr double small = 1 << 18;  // cells: 1.3 m × 1.3 m at 2 cm
  const Eigen::AlignedBox2d box = box_of(surface);
  const double area = box.isEmpty() ? 0 : box.sizes().prod();
  double edge = (surface.resolution > 0 ? surface.resolution : 0.02) / 8;
  for (double most = small; area > most * edge * edge; most = 1 << 28) edge *= 2;
  return edge;
}

template <class Visit>
bool BitRaster::in_run(int y, int from, int to, const Visit& visit) const {
  from = std::max(from, 0), to = std::min(to, width_ - 1);
  for (int word = from / bits; from <= to && word <= to / bits; ++word) {
    Word mask = ~Word{0};
    if (word == from / bits) mask <<= from % bits;
    if (word == to / bits) mask &= ~Word{0} >> (bits - 1 - to % bits);
    if (visit(static_cast<std::size_t>(y) * static_cast<std::size_t>(row_words_) +
                  static_cast<std::size_t>(word),
              mask))
      return true;
  }
  return false;
}

template <class Visit>
bool BitRaster::in_rows(const Ring2& convex, double more, const Visit& visit) const {
  const Spans spans(convex, edge_, more);
  for (std::size_t i = 0; i < spans.rows.size(); ++i) {
    const int y = spans.first + static_cast<int>(i) - y0_;
    if (y < 0 || y >= height_) continue;
    const auto column = [&](double x) { return static_cast<int>(std::floor(x)) - x0_; };
    if (in_run(y, column(spans.rows[i].low - more), column(spans.rows[i].high + more), visit)) return true;
  }
  return false;
}

void BitRaster::mark(const Ring2& convex, double more) {
  in_rows(convex, more, [this](std::size_t word, Word mask) { return words_[word] |= mask, false; });
}

bool BitRaster::touched_by(const Ring2& convex, double more) const {
  return in_rows(convex, more, [this](std::size_t word, Word mask) { return (words_[word] & mask) != 0; });
}

void BitRaster::for_each_touched(const Ring2& convex,
                                 const std::function<void(const Eigen::Vector2d&, bool)>& visit) const {
  in_rows(convex, rounding, [&](std::size_t word, Word mask) {
    const auto row_words = static_cast<std::size_t>(row_words_);
    const Corner first(static_cast<int>(word % row_words) * bits, static_cast<int>(word / row_words));
    for (Word left = mask; left != 0; left &= left - 1)
      visit(place_of(first + Corner(std::countr_zero(left), 0)).array() + edge_ / 2,
            (words_[word] & left & (~left + 1)) != 0);
    return false;
  });
}

void BitRaster::mark_outside(const std::vector<Polygon>& polygons) {
  std::ranges::fill(words_, ~Word{0});
  // Edges of clipping lie beyond.
  CellRuns(clipped(polygons, box_about(box(), 2 * edge_)), edge_)
      .for_each_run([this](std::int64_t y, std::int32_t from, std::int32_t end) {
        if (y < y0_ || y >= y0_ + height_) return;
        in_run(static_cast<int>(y) - y0_, from - x0_, end - 1 - x0_,
               [this](std::size_t word, Word mask) { return words_[word] &= ~mask, false; });
      });
  for_each_edge(polygons, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    if (box().intersects(Eigen::AlignedBox2d(a.cwiseMin(b), a.cwiseMax(b)))) mark({a, b});
  });
}

BitRaster BitRaster::blank() const {
  BitRaster raster = *this;
  std::ranges::fill(raster.words_, 0);
  return raster;
}

void BitRaster::add(const BitRaster& other) {
  for (int y = std::max(0, other.y0_ - y0_); y < std::min(height_, other.y0_ - y0_ + other.height_); ++y)
    for (int word = 0; word < row_words_; ++word)
      row(y)[word] |=
          bits_at(other.row(y + y0_ - other.y0_), other.row_words_, word * bits + x0_ - other.x0_);
}

BitRaster BitRaster::dilated(const Ring2& convex) const {
  // A place in one cell, a mark in another: they differ by whole cells, and up to one more both ways.
  struct Run {
    int dy, from, count;
  };
  std::vector<Run> runs;
  const Spans spans(convex, edge_, rounding);
  for (std::size_t i = 0; i <= spans.rows.size(); ++i) {
    Spans::Span both = spans.rows[i == 0 ? 0 : i - 1];
    if (i < spans.rows.size()) both.extend(spans.rows[i].low), both.extend(spans.rows[i].high);
    const int from = static_cast<int>(std::ceil(both.low - 1 - rounding)),
              to = static_cast<int>(std::floor(both.high + 1 + rounding));
    runs.push_back({spans.first + static_cast<int>(i), from, to - from + 1});
  }
  std::ranges::sort(runs, {}, &Run::count);
  BitRaster result = blank();
  const int longest = runs.empty() ? 0 : runs.back().count, spread_words = row_words_ + longest / bits + 1;
  std::vector<Word> spread;
  for (int y = 0; y < height_; ++y) {
    const Word* const marks = row(y);
    if (std::all_of(marks, marks + row_words_, [](Word word) { return word == 0; })) continue;
    spread.assign(marks, marks + row_words_);
    spread.resize(static_cast<std::size_t>(spread_words), 0);
    if (width_ % bits != 0)
      spread[static_cast<std::size_t>(row_words_) - 1] &= ~Word{0} >> (bits - width_ % bits);
    int count = 1;  // cells that each mark covers, toward greater x
    for (const Run& run : runs) {
      while (count < run.count) {
        const int by = std::min({count, run.count - count, bits - 1});
        for (int word = spread_words; word-- > 0;)
          spread[static_cast<std::size_t>(word)] |=
              spread[static_cast<std::size_t>(word)] << by |
              (word > 0 ? spread[static_cast<std::size_t>(word) - 1] >> (bits - by) : 0);
        count += by;
      }
      const int to = y - run.dy, off = run.from + run.count - 1;
      if (to < 0 || to >= height_) continue;
      for (int word = 0; word < row_words_; ++word)
        result.row(to)[word] |= bits_at(spread.data(), spread_words, word * bits + off);
    }
  }
  return result;
}

/// Marks one of two free cells that meet at a corner only, so that rings come to no vertex twice.
void BitRaster::separate_corners() {
  for (int y = 0; y + 1 < height_; ++y)
    for (bool again = true; again;) {
      again = false;
      Word* const upper = row(y + 1);
      const Word* const lower = row(y);
      for (int word = 0; word < row_words_; ++word) {
        const auto next = [&](const Word* words) {  // of each cell, that to its right
          return bits_at(words, row_words_, word * bits + 1, ~Word{0});
        };
        const Word a = lower[word], b = next(lower), c = upper[word], e = next(upper);
        const Word rising = ~a & b & c & ~e, falling = a & ~b & ~c & e;
        if ((rising | falling) == 0) continue;
        again = true;
        upper[word] |= falling | rising << 1;
        if ((rising >> (bits - 1)) != 0 && word + 1 < row_words_) upper[word + 1] |= 1;
      }
    }
}

/// Of the ring with free cells to its left that comes down the left side of a cell.
std::vector<Corner> BitRaster::corners_at(int x, int y, BitRaster& traced) const {
  std::vector<Corner> corners;
  const Corner start(x, y + 1);
  Corner at = start, heading(0, -1);
  do {
    if (heading.y() < 0) traced.row(at.y() - 1)[at.x() / bits] |= Word{1} << (at.x() % bits);
    at += heading;
    const Corner left(-heading.y(), heading.x());
    const auto free_at = [&](const Corner& side) {  // of the two cells ahead
      const Corner twice = 2 * at + heading + side;
      return is_free(twice.x() >> 1, twice.y() >> 1);
    };
    const Corner before = heading;
    if (!free_at(left))
      heading = left;
    else if (free_at(-left))
      heading = -left;
    if (heading != before) corners.push_back(at);
  } while (at != start || heading.y() >= 0);
  return corners;
}

/// `taken`: cells that no cut may cross; those of the cuts are added.
Ring2 BitRaster::simplified(const std::vector<Corner>& corners, BitRaster& taken) const {
  Ring2 ring;
  for (std::size_t i = 0; i < corners.size();) {
    ring.push_back(place_of(corners[i]));
    std::size_t next = i + 1;
    // Not far ahead, nor far beyond the best so far: few such cuts are found.
    for (std::size_t k = i + 2; k <= std::min({i + 128, next + 16, corners.size()}); ++k)
      if (can_skip(corners, i, k)) next = k;
    if (next > i + 1) {
      const Ring2 cut{ring.back(), place_of(corners[next % corners.size()])};
      if (taken.touched_by(cut, -rounding))
        next = i + 1;
      else
        taken.mark(cut, -rounding);
    }
    i = next;
  }
  return ring;
}

std::vector<Polygon> BitRaster::free_polygons() const {
  BitRaster cells = *this, traced = blank();
  for (int y = 0; y < height_ && width_ % bits != 0; ++y)
    cells.row(y)[row_words_ - 1] |= ~Word{0} << width_ % bits;
  cells.separate_corners();
  BitRaster taken = cells;
  std::vector<Ring2> rings;
  for (int y = 0; y < height_; ++y)
    for (int word = 0; word < row_words_; ++word) {
      const Word marks = cells.row(y)[word],
                 before = bits_at(cells.row(y), row_words_, word * bits - 1, ~Word{0});
      for (Word left = ~marks & before; left != 0; left &= left - 1) {
        const int x = word * bits + std::countr_zero(left);
        if (x >= width_ || (traced.row(y)[word] >> (x % bits) & 1) != 0) continue;
        Ring2 ring = simplified(cells.corners_at(x, y, traced), taken);
        if (ring.size() >= 3 && geometry::signed_area(ring) != 0) rings.push_back(std::move(ring));
      }
    }
  return geometry::polygons_of(std::move(rings));
}

}  // namespace octosurf::planning
