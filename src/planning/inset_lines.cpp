#include "planning/inset_lines.hpp"

#include "planning/rings.hpp"

#include <algorithm>
#include <array>

namespace octosurf::planning {
namespace {

std::size_t eights_of(const Ring2& ring) {
  return (ring.size() + EdgeReaches::at_once - 1) / EdgeReaches::at_once;
}

}  // namespace

void InsetLines::assign(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> besides) {
  kernel_ = ConvexLines(kernel);
  corners_.clear();
  around_.clear();
  eights_.clear();
  besides_.clear();
  first_beside_line_.clear();
  box_.setEmpty();
  std::size_t eights = eights_of(polygon.outer);
  for (const Ring2& hole : polygon.holes) eights += eights_of(hole);
  eights_.reserve(eights);
  corners_.reserve(eights * EdgeReaches::at_once);
  around_.reserve(eights * EdgeReaches::at_once);
  add_ring(polygon.outer);
  for (const Ring2& hole : polygon.holes) add_ring(hole);
  add_reaches();
  count_lines();
  add_besides(besides);
}

void InsetLines::add_ring(const Ring2& ring) {
  const auto first = static_cast<std::uint32_t>(corners_.size());
  const auto n = static_cast<std::uint32_t>(ring.size());
  for (std::uint32_t i = 0; i < n; ++i) {
    // Reversed: rings have the polygon to their left.
    const Eigen::Vector2d &p = ring[n - 1 - i], &q = ring[i + 1 < n ? n - 2 - i : n - 1];
    corners_.push_back(p + jitter_of(p, q));
    Around around;
    around.next = i + 1 < n ? first + i + 1 : first;
    around.previous = i > 0 ? first + i - 1 : first + n - 1;
    around_.push_back(around);
  }
  corners_.resize(first + eights_of(ring) * EdgeReaches::at_once);
  around_.resize(corners_.size());
  for (std::uint32_t i = 0; i < n; i += EdgeReaches::at_once) {
    Eight eight{std::min(n - i, EdgeReaches::at_once), {}};
    for (std::uint32_t edge = 0; edge < eight.edges; ++edge) eight.box.extend(corners_[first + i + edge]);
    eight.box.extend(corners_[around_[first + i + eight.edges - 1].next]);
    box_.extend(eight.box);
    eights_.push_back(eight);
  }
}

void InsetLines::add_reaches() {
  reaches_.assign(kernel_, eights_.size());
  std::array<Eigen::Vector2d, EdgeReaches::at_once + 1> chain;
  for (std::uint32_t e = 0; e < eights_.size(); ++e) {
    const std::uint32_t first = e * EdgeReaches::at_once, edges = eights_[e].edges;
    for (std::uint32_t i = 0; i < edges; ++i) chain[i] = corners_[first + i];
    chain[edges] = corners_[around_[first + edges - 1].next];
    const auto farthest = reaches_.set(e, std::span(chain).first(edges + 1));
    for (std::uint32_t i = 0; i < edges; ++i) around_[first + i].farthest = farthest[i];
  }
}

void InsetLines::count_lines() {
  const auto m = static_cast<std::uint32_t>(kernel_.corners.size());
  line_count_ = 0;
  for (std::uint32_t e = 0; e < eights_.size(); ++e)
    for (std::uint32_t i = e * EdgeReaches::at_once, last = i + eights_[e].edges; i < last; ++i) {
      Around& around = around_[i];
      const Around& ahead = around_[around.next];
      const Eigen::Vector2d &a = corners_[i], &b = corners_[around.next], &c = corners_[ahead.next];
      // Left and right turns are unpredictable: avoids a branch.
      const std::uint32_t left = cross(b - a, c - b) > 0 ? 1 : 0;
      around.front_line = line_count_;
      around.sides = left * round(ahead.farthest + m - around.farthest);
      around.joined = (left | (ahead.farthest == around.farthest ? 1U : 0U)) != 0;
      line_count_ += 1 + around.sides;
    }
}

InsetLines::Line InsetLines::line(std::uint32_t edge, std::uint32_t nth) const {
  const Around& around = around_[edge];
  const std::uint32_t number = around.front_line + nth;
  const std::uint32_t next = nth < around.sides ? number + 1
                             : around.joined    ? around_[around.next].front_line
                                                : none;
  const Eigen::Vector2d& end = corners_[around.next];
  if (nth == 0) {
    const Eigen::Vector2d& far = kernel_.corners[around.farthest];
    return {corners_[edge] + far, end + far, number, next};
  }
  const std::uint32_t k = round(around.farthest + nth - 1);
  return {end + kernel_.corners[k], end + kernel_.corners[round(k + 1)], number, next};
}

InsetLines::Line InsetLines::beside_line(std::uint32_t beside, std::uint32_t side) const {
  const Ring2& corners = besides_[beside].corners;
  const std::uint32_t next = side + 1 < corners.size() ? side + 1 : 0;
  const std::uint32_t first = first_beside_line_[beside];
  return {corners[side], corners[next], first + side, first + next};
}

void InsetLines::add_besides(std::span<const Ring2> besides) {
  for (std::size_t i = 0; i < besides.size(); ++i) {
    Ring2 moved = besides[i];
    // Seeded with its number, for there may be equal ones.
    const Eigen::Vector2d by = jitter_of(moved.front(), Eigen::Vector2d::Constant(static_cast<double>(i)));
    for (Eigen::Vector2d& p : moved) p += by;
    ConvexLines beside(moved);
    if (!beside.box.intersects(box_)) continue;
    first_beside_line_.push_back(line_count_);
    line_count_ += static_cast<std::uint32_t>(moved.size());
    besides_.push_back(std::move(beside));
  }
}

std::uint32_t InsetLines::line_of_side(std::uint32_t edge, std::uint32_t side) const {
  const auto m = static_cast<std::uint32_t>(kernel_.corners.size());
  if (side == none) return none;
  if (side == m) return around_[edge].front_line;
  if (side == m + 1) return open;
  // A kernel's side belongs to the edge's end farther along it; it is a line if the corner there is convex.
  const Eigen::Vector2d& normal = kernel_.normals[side];
  const Around& around = around_[edge];
  const Around& before =
      normal.dot(corners_[around.next]) > normal.dot(corners_[edge]) ? around : around_[around.previous];
  const std::uint32_t nth = round(side + m - before.farthest);
  return nth < before.sides ? before.front_line + 1 + nth : open;
}

}  // namespace octosurf::planning
