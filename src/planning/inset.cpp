#include "planning/inset.hpp"

#include "geometry/even_odd.hpp"
#include "planning/cell_grid.hpp"
#include "planning/convex_lines.hpp"
#include "planning/convex_sides.hpp"
#include "planning/rings.hpp"

#include <tsl/robin_map.h>

namespace octosurf::planning {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// A part of a line that nothing covers, and the lines that cut it off at its ends; none where it reaches the
/// line's own end, `open` where what cuts it is no line that can bound anything.
struct Rest {
  std::uint32_t line = 0;
  double from = 0, to = 1;
  std::uint32_t from_by = none, to_by = none;
};
constexpr std::uint32_t open = none - 1;

class Inset {
 public:
  Inset(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> besides);

  std::optional<std::vector<Polygon>> run();

 private:
  struct Line {
    Eigen::Vector2d from, to;
    std::uint32_t next = none;  // the line that goes on at its end, if one does
  };

  void add_ring(const Ring2& ring);
  void add_edge_lines();
  void add_besides(std::span<const Ring2> besides);
  void fill_grids();

  bool cut_by_edge(std::uint32_t edge, const Line& line, Cut& cut) const;
  bool cut_by_beside(std::uint32_t beside, const Line& line, Cut& cut) const;
  std::uint32_t line_of_side(std::uint32_t edge, std::uint32_t side) const;

  void begin(std::uint32_t line);
  void uncover(std::uint32_t line, std::uint32_t at, bool corner);
  void uncover_beside(std::uint32_t line, std::uint32_t beside);
  void take_off(const Cut& cut, std::uint32_t in_by, std::uint32_t out_by);
  bool take_off_edge(std::uint32_t edge, const Line& line);
  bool take_off_near(const Line& line, std::uint32_t skip0, std::uint32_t skip1, std::uint32_t skip2,
                     std::uint32_t skip_beside);

  std::optional<std::vector<Ring2>> chain() const;
  bool in_polygon(const Eigen::Vector2d& p) const;

  ConvexLines kernel_;
  // Edge i goes from corner i to corner next_[i]; what is not the polygon lies to its left.
  Ring2 corners_;
  std::vector<std::uint32_t> next_, previous_;
  std::vector<double> front_, back_;  // offsets of the two lines along edge i
  // Lines of edge i, in order: its front, front_line_[i], then sides_[i] of the kernel's sides about its end,
  // from side first_side_[i]; the next edge's front goes on from there if they are joined.
  std::vector<std::uint32_t> front_line_, first_side_, sides_;
  std::vector<char> joined_;
  std::vector<ConvexLines> besides_;
  std::vector<std::uint32_t> beside_line_;  // first of each
  std::vector<Line> lines_;
  std::optional<CellGrid> edge_grid_, beside_grid_, rows_;
  // In which round an edge was seen last: the grids tell some several times.
  std::vector<std::uint32_t> seen_edge_, seen_beside_;
  std::uint32_t round_ = 0;
  // How far along the kernel's normals: every corner, and the two ends of the line at hand.
  std::vector<double> along_kernel_, line_from_, line_to_;
  std::vector<Rest> left_, scratch_;  // of the line at hand
  std::vector<Rest> rests_;
  Eigen::AlignedBox2d box_;
};

Inset::Inset(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> besides) : kernel_(kernel) {
  std::size_t n = polygon.outer.size();
  for (const Ring2& hole : polygon.holes) n += hole.size();
  for (auto* indices : {&next_, &previous_, &front_line_, &first_side_, &sides_}) indices->reserve(n);
  corners_.reserve(n);
  lines_.reserve(2 * n);  // about as many corners of a rough outline stick out as do not
  add_ring(polygon.outer);
  for (const Ring2& hole : polygon.holes) add_ring(hole);
  line_from_.resize(kernel_.corners.size());
  line_to_.resize(kernel_.corners.size());
  along_kernel_.reserve(corners_.size() * kernel_.corners.size());
  for (const Eigen::Vector2d& corner : corners_)
    for (const Eigen::Vector2d& normal : kernel_.normals) along_kernel_.push_back(normal.dot(corner));
  add_edge_lines();
  add_besides(besides);
  fill_grids();
}

void Inset::add_ring(const Ring2& ring) {
  const auto first = static_cast<std::uint32_t>(corners_.size());
  const auto n = static_cast<std::uint32_t>(ring.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    // Backwards: rings have the polygon to their left.
    const Eigen::Vector2d &p = ring[n - 1 - i], &q = ring[i + 1 < n ? n - 2 - i : n - 1];
    corners_.push_back(p + jitter_of(p, q));
    box_.extend(corners_.back());
    next_.push_back(i + 1 < n ? first + i + 1 : first);
    previous_.push_back(i > 0 ? first + i - 1 : first + n - 1);
  }
}

void Inset::add_edge_lines() {
  const std::size_t n = corners_.size(), m = kernel_.corners.size();
  std::vector<std::size_t> farthest(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d along = corners_[next_[i]] - corners_[i], right = right_of(along);
    farthest[i] = kernel_.farthest_right_of(along);
    front_.push_back(right.dot(corners_[i] + kernel_.corners[farthest[i]]));
    back_.push_back(-right.dot(corners_[i] + kernel_.corners[kernel_.farthest_right_of(-along)]));
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d &a = corners_[i], &b = corners_[next_[i]], &c = corners_[next_[next_[i]]];
    front_line_.push_back(static_cast<std::uint32_t>(lines_.size()));
    const Eigen::Vector2d far = kernel_.corners[farthest[i]];
    lines_.push_back({a + far, b + far});
    const std::size_t then = farthest[next_[i]];
    const bool left = cross(b - a, c - b) > 0;
    const std::size_t sides = left ? (then + m - farthest[i]) % m : 0;
    joined_.push_back(left || then == farthest[i]);
    first_side_.push_back(static_cast<std::uint32_t>(farthest[i]));
    sides_.push_back(static_cast<std::uint32_t>(sides));
    for (std::size_t s = 0; s < sides; ++s) {
      const std::size_t k = (farthest[i] + s) % m;
      lines_.push_back({b + kernel_.corners[k], b + kernel_.corners[(k + 1) % m]});
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!joined_[i]) continue;
    const std::uint32_t last = front_line_[i] + sides_[i];
    for (std::uint32_t line = front_line_[i]; line < last; ++line) lines_[line].next = line + 1;
    lines_[last].next = front_line_[next_[i]];
  }
}

void Inset::add_besides(std::span<const Ring2> besides) {
  for (std::size_t i = 0; i < besides.size(); ++i) {
    Ring2 moved = besides[i];
    // With its number, for there may be two of the same.
    const Eigen::Vector2d by = jitter_of(moved.front(), Eigen::Vector2d::Constant(static_cast<double>(i)));
    for (Eigen::Vector2d& p : moved) p += by;
    ConvexLines beside(moved);
    if (!beside.box.intersects(box_)) continue;
    const auto first = static_cast<std::uint32_t>(lines_.size());
    const auto n = static_cast<std::uint32_t>(moved.size());
    beside_line_.push_back(first);
    for (std::uint32_t k = 0; k < n; ++k)
      lines_.push_back({moved[k], moved[(k + 1) % n], first + (k + 1) % n});
    besides_.push_back(std::move(beside));
  }
}

void Inset::fill_grids() {
  const Eigen::Vector2d size = box_.sizes(), reach = kernel_.box.sizes();
  // Cells of half the kernel's width, so that few edges beyond its reach are looked at; not many more than
  // edges.
  const double n = static_cast<double>(corners_.size() + besides_.size());
  const double cell =
      std::max({reach.minCoeff() / 2, std::sqrt(size.x() * size.y() / (4 * n)), 1e-6 * size.maxCoeff()});
  edge_grid_.emplace(box_, cell);
  beside_grid_.emplace(box_, cell);
  // One column: all that a level line meets.
  Eigen::AlignedBox2d flat(Eigen::Vector2d(0, box_.min().y()), Eigen::Vector2d(0, box_.max().y()));
  rows_.emplace(flat, std::max(cell, size.y() / (n + 1)));
  for (std::uint32_t i = 0; i < corners_.size(); ++i) {
    const Eigen::Vector2d &a = corners_[i], &b = corners_[next_[i]];
    edge_grid_->add(i, a, b);
    Eigen::AlignedBox2d rows(Eigen::Vector2d(0, std::min(a.y(), b.y())),
                             Eigen::Vector2d(0, std::max(a.y(), b.y())));
    rows_->add(i, rows);
  }
  for (std::uint32_t b = 0; b < besides_.size(); ++b) beside_grid_->add(b, besides_[b].box);
  edge_grid_->finish();
  beside_grid_->finish();
  rows_->finish();
  seen_edge_.assign(corners_.size(), 0);
  seen_beside_.assign(besides_.size(), 0);
}

// Sides 0 to m − 1: the kernel's; m: the front; m + 1: the back.
bool Inset::cut_by_edge(std::uint32_t edge, const Line& line, Cut& cut) const {
  const Eigen::Vector2d &p = corners_[edge], &q = corners_[next_[edge]], &a = line.from, &b = line.to;
  const double *along_p = &along_kernel_[edge * line_from_.size()],
               *along_q = &along_kernel_[next_[edge] * line_from_.size()];
  const auto m = static_cast<std::uint32_t>(kernel_.corners.size());
  // Most edges are beyond reach, and of the rest most cover all of the line: both without a branch for each
  // side.
  double both = HUGE_VAL, either = HUGE_VAL;
  for (std::uint32_t k = 0; k < m; ++k) {
    const double offset = std::max(along_p[k], along_q[k]) + kernel_.offsets[k];
    const double at_a = offset - line_from_[k], at_b = offset - line_to_[k];
    both = std::min(both, std::min(at_a, at_b));
    either = std::min(either, std::max(at_a, at_b));
  }
  if (either <= 0) return false;
  const Eigen::Vector2d right = right_of(q - p);
  const double along_a = right.dot(a), along_b = right.dot(b);
  if (!cut.by(front_[edge] - along_a, front_[edge] - along_b, m) ||
      !cut.by(along_a + back_[edge], along_b + back_[edge], m + 1))
    return false;
  if (both >= 0) return true;
  for (std::uint32_t k = 0; k < m; ++k) {
    const double offset = std::max(along_p[k], along_q[k]) + kernel_.offsets[k];
    if (!cut.by(offset - line_from_[k], offset - line_to_[k], k)) return false;
  }
  return true;
}

bool Inset::cut_by_beside(std::uint32_t beside, const Line& line, Cut& cut) const {
  const ConvexLines& one = besides_[beside];
  for (std::uint32_t k = 0; k < one.corners.size(); ++k)
    if (!cut.by(one.offsets[k] - one.normals[k].dot(line.from), one.offsets[k] - one.normals[k].dot(line.to),
                k))
      return false;
  return true;
}

// The line that bounds an edge's reach on that side; none or open as in Rest.
std::uint32_t Inset::line_of_side(std::uint32_t edge, std::uint32_t side) const {
  const auto m = static_cast<std::uint32_t>(kernel_.corners.size());
  if (side == none) return none;
  if (side == m) return front_line_[edge];
  if (side == m + 1) return open;
  // A kernel's side is about the end that is farther on that side; it is a line there if the corner sticks
  // out.
  const Eigen::Vector2d& normal = kernel_.normals[side];
  const std::uint32_t before =
      normal.dot(corners_[next_[edge]]) > normal.dot(corners_[edge]) ? edge : previous_[edge];
  const std::uint32_t nth = (side + m - first_side_[before]) % m;
  return nth < sides_[before] ? front_line_[before] + 1 + nth : open;
}

void Inset::take_off(const Cut& cut, std::uint32_t in_by, std::uint32_t out_by) {
  scratch_.clear();
  for (const Rest& rest : left_) {
    if (cut.out <= rest.from || cut.in >= rest.to) {
      scratch_.push_back(rest);
      continue;
    }
    if (cut.in > rest.from) scratch_.push_back({rest.line, rest.from, cut.in, rest.from_by, in_by});
    if (cut.out < rest.to) scratch_.push_back({rest.line, cut.out, rest.to, out_by, rest.to_by});
  }
  left_.swap(scratch_);
}

// False if nothing of the line is left.
bool Inset::take_off_edge(std::uint32_t edge, const Line& line) {
  Cut cut;
  if (cut_by_edge(edge, line, cut))
    take_off(cut, line_of_side(edge, cut.in_side), line_of_side(edge, cut.out_side));
  return !left_.empty();
}

bool Inset::take_off_near(const Line& line, std::uint32_t skip0, std::uint32_t skip1, std::uint32_t skip2,
                          std::uint32_t skip_beside) {
  ++round_;
  Eigen::AlignedBox2d box(line.from.cwiseMin(line.to), line.from.cwiseMax(line.to));
  const Eigen::AlignedBox2d about(box.min() - kernel_.box.max(), box.max() - kernel_.box.min());
  edge_grid_->visit(about, [&](std::uint32_t edge) {
    if (seen_edge_[edge] == round_ || left_.empty()) return;
    seen_edge_[edge] = round_;
    if (edge != skip0 && edge != skip1 && edge != skip2) take_off_edge(edge, line);
  });
  beside_grid_->visit(box, [&](std::uint32_t beside) {
    if (seen_beside_[beside] == round_ || left_.empty() || beside == skip_beside) return;
    seen_beside_[beside] = round_;
    Cut cut;
    if (!cut_by_beside(beside, line, cut)) return;
    const auto line_of = [&](std::uint32_t side) {
      return side == none ? none : beside_line_[beside] + side;
    };
    take_off(cut, line_of(cut.in_side), line_of(cut.out_side));
  });
  return !left_.empty();
}

void Inset::begin(std::uint32_t line) {
  left_.assign(1, {line, 0, 1, none, none});
  for (std::size_t k = 0; k < line_from_.size(); ++k) {
    line_from_[k] = kernel_.normals[k].dot(lines_[line].from);
    line_to_[k] = kernel_.normals[k].dot(lines_[line].to);
  }
}

// What touches a line by its making is not asked whether it covers it, which rounding would decide.
void Inset::uncover(std::uint32_t line, std::uint32_t at, bool corner) {
  const std::uint32_t ahead = next_[at], behind = previous_[at];
  const std::uint32_t skip1 = corner || joined_[at] ? ahead : none;
  const std::uint32_t skip2 = !corner && joined_[behind] ? behind : none;
  begin(line);
  // Neighbours first: mostly they cover all of it.
  std::uint32_t forward = ahead, backward = behind;
  for (int step = 0; step < 4; ++step, forward = next_[forward], backward = previous_[backward])
    for (const std::uint32_t edge : {forward, backward})
      if (edge != at && edge != skip1 && edge != skip2 && !take_off_edge(edge, lines_[line])) return;
  if (take_off_near(lines_[line], at, skip1, skip2, none))
    rests_.insert(rests_.end(), left_.begin(), left_.end());
}

void Inset::uncover_beside(std::uint32_t line, std::uint32_t beside) {
  begin(line);
  if (take_off_near(lines_[line], none, none, none, beside))
    rests_.insert(rests_.end(), left_.begin(), left_.end());
}

bool Inset::in_polygon(const Eigen::Vector2d& p) const {
  if (!box_.contains(p)) return false;
  bool inside = false;
  const Eigen::Vector2d level(0, p.y());
  rows_->visit({level, level}, [&](std::uint32_t edge) {
    const Eigen::Vector2d &a = corners_[edge], &b = corners_[next_[edge]];
    inside ^= geometry::passes_left_of(p, a, b);
  });
  return inside;
}

// Rests go on where the same two lines meet. What lies off the polygon is bounded by nothing that was asked
// for and is dropped, closed or not.
std::optional<std::vector<Ring2>> Inset::chain() const {
  std::vector<std::uint32_t> at_start(lines_.size(), none);
  tsl::robin_map<std::uint64_t, std::uint32_t> at_crossing;
  const auto crossing = [](std::uint32_t one, std::uint32_t other) {
    return std::uint64_t{std::min(one, other)} << 32 | std::max(one, other);
  };
  for (std::uint32_t r = 0; r < rests_.size(); ++r) {
    const Rest& rest = rests_[r];
    if (rest.from_by == none)
      at_start[rest.line] = r;
    else if (rest.from_by != open)
      at_crossing[crossing(rest.line, rest.from_by)] = r;
  }
  const auto after = [&](const Rest& rest) -> std::uint32_t {
    if (rest.to_by == open) return none;
    if (rest.to_by == none) {
      const std::uint32_t next = lines_[rest.line].next;
      return next == none ? none : at_start[next];
    }
    const auto found = at_crossing.find(crossing(rest.line, rest.to_by));
    return found == at_crossing.end() || rests_[found->second].line == rest.line ? none : found->second;
  };
  const auto point = [&](const Rest& rest, double t) {
    return Eigen::Vector2d(lines_[rest.line].from + t * (lines_[rest.line].to - lines_[rest.line].from));
  };
  std::vector<Ring2> rings;
  std::vector<char> used(rests_.size(), 0);
  for (std::uint32_t first = 0; first < rests_.size(); ++first) {
    if (used[first]) continue;
    Ring2 ring;
    std::uint32_t r = first;
    for (; r != none && !used[r]; r = after(rests_[r])) {
      used[r] = 1;
      ring.push_back(point(rests_[r], rests_[r].from));
    }
    if (!in_polygon(point(rests_[first], (rests_[first].from + rests_[first].to) / 2))) continue;
    if (r != first || ring.size() < 3) return {};
    std::reverse(ring.begin(), ring.end());  // what is left to the left
    rings.push_back(std::move(ring));
  }
  return rings;
}

/// Holes into the smallest part that is around them.
std::optional<std::vector<Polygon>> nested(std::vector<Ring2> rings) {
  std::vector<Polygon> parts;
  std::vector<Ring2> holes;
  for (Ring2& ring : rings) {
    if (area_of(ring) <= 0)
      holes.push_back(std::move(ring));
    else
      parts.push_back({std::move(ring), {}});
  }
  std::sort(parts.begin(), parts.end(),
            [](const Polygon& a, const Polygon& b) { return area_of(a.outer) < area_of(b.outer); });
  for (Ring2& hole : holes) {
    const auto around = std::find_if(parts.begin(), parts.end(), [&](const Polygon& part) {
      return parts.size() == 1 || contains({part.outer, {}}, hole.front());
    });
    if (around == parts.end()) return {};
    around->holes.push_back(std::move(hole));
  }
  return parts;
}

std::optional<std::vector<Polygon>> Inset::run() {
  for (std::uint32_t i = 0; i < corners_.size(); ++i) {
    uncover(front_line_[i], i, false);
    for (std::uint32_t s = 0; s < sides_[i]; ++s) uncover(front_line_[i] + 1 + s, i, true);
  }
  for (std::uint32_t b = 0; b < besides_.size(); ++b)
    for (std::uint32_t k = 0; k < besides_[b].corners.size(); ++k) uncover_beside(beside_line_[b] + k, b);
  std::optional<std::vector<Ring2>> rings = chain();
  if (!rings) return {};
  return nested(std::move(*rings));
}

}  // namespace

std::optional<std::vector<Polygon>> inset(const Polygon& polygon, const Ring2& kernel,
                                          std::span<const Ring2> besides) {
  if (polygon.outer.size() < 3) return std::vector<Polygon>{};
  return Inset(polygon, kernel, besides).run();
}

}  // namespace octosurf::planning
