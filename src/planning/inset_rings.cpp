#include "planning/inset_rings.hpp"

#include "geometry/even_odd.hpp"
#include "planning/cell_grid.hpp"
#include "planning/convex_sides.hpp"

#include <algorithm>
#include <utility>

namespace octosurf::planning {
namespace {

/// Tests which points are inside the polygon of these edges.
class InsideOf {
 public:
  explicit InsideOf(const InsetLines& lines) : lines_(lines), rows_(all_rows(lines), row_height(lines)) {
    for (std::uint32_t e = 0; e < lines.eights().size(); ++e) rows_.add(e, one_column(lines.eights()[e].box));
    rows_.finish();
  }

  bool operator()(const Eigen::Vector2d& p) const {
    if (!lines_.box().contains(p)) return false;
    bool inside = false;
    const Eigen::Vector2d level(0, p.y());
    rows_.visit({level, level}, [&](std::uint32_t e) {
      const InsetLines::Eight& eight = lines_.eights()[e];
      if (eight.box.min().x() >= p.x()) return;
      const std::uint32_t first = e * EdgeReaches::at_once;
      for (std::uint32_t edge = first; edge < first + eight.edges; ++edge)
        inside ^= geometry::passes_left_of(p, lines_.corner(edge), lines_.corner(lines_.next(edge)));
    });
    return inside;
  }

 private:
  /// A horizontal line stays in one row.
  static Eigen::AlignedBox2d one_column(const Eigen::AlignedBox2d& box) {
    return {Eigen::Vector2d(0, box.min().y()), Eigen::Vector2d(0, box.max().y())};
  }
  static Eigen::AlignedBox2d all_rows(const InsetLines& lines) { return one_column(lines.box()); }
  /// No more rows than eights of edges.
  static double row_height(const InsetLines& lines) {
    const Eigen::Vector2d size = lines.box().sizes();
    return std::max(size.y() / static_cast<double>(lines.eights().size()), 1e-6 * size.maxCoeff());
  }

  const InsetLines& lines_;
  CellGrid rows_;
};

class RestChains {
 public:
  RestChains(std::uint32_t lines, std::span<const Rest> rests) : rests_(rests) {
    first_of_.resize(lines + std::size_t{1});
    std::uint32_t line = 0;
    for (std::uint32_t r = 0; r < rests.size(); ++r)
      while (line <= rests[r].line) first_of_[line++] = r;
    while (line <= lines) first_of_[line++] = static_cast<std::uint32_t>(rests.size());
  }

  /// The rest that continues this one, if any.
  std::uint32_t after(const Rest& rest) const {
    if (rest.to_by == open) return none;
    if (rest.to_by != none) return starting(rest.to_by, rest.line);
    return rest.next == none ? none : starting(rest.next, none);
  }

 private:
  /// The rest of a line that starts at its intersection with another, or (none) at its own beginning.
  std::uint32_t starting(std::uint32_t line, std::uint32_t by) const {
    for (std::uint32_t r = first_of_[line]; r < first_of_[line + 1]; ++r)
      if (rests_[r].from_by == by) return r;
    return none;
  }

  std::span<const Rest> rests_;          // by line, mostly one
  std::vector<std::uint32_t> first_of_;  // of each line, then all
};

std::optional<std::vector<Ring2>> rings_of(const InsetLines& lines, std::span<const Rest> rests) {
  const RestChains chains(lines.line_count(), rests);
  const InsideOf in_polygon(lines);
  std::vector<Ring2> rings;
  std::vector<char> used(rests.size(), 0);
  std::vector<std::uint32_t> chain;
  for (std::uint32_t first = 0; first < rests.size(); ++first) {
    if (used[first]) continue;
    chain.clear();
    std::uint32_t r = first;
    for (; r != none && !used[r]; r = chains.after(rests[r])) {
      used[r] = 1;
      chain.push_back(r);
    }
    if (!in_polygon(rests[first].start)) continue;
    if (r != first || chain.size() < 3) return {};
    Ring2 ring;
    ring.reserve(chain.size());
    // Reversed, so that the interior is on the left.
    for (auto at = chain.rbegin(); at != chain.rend(); ++at) ring.push_back(rests[*at].start);
    rings.push_back(std::move(ring));
  }
  return rings;
}

/// Assigns holes to the smallest part around them.
std::optional<std::vector<Polygon>> nested(std::vector<Ring2> rings) {
  struct NestedPart {
    double area = 0;
    Ring2 outer;
    Eigen::AlignedBox2d box;
  };
  std::vector<NestedPart> parts;
  std::vector<Ring2> holes;
  for (Ring2& ring : rings) {
    if (const double area = area_of(ring); area <= 0) {
      holes.push_back(std::move(ring));
    } else {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& p : ring) box.extend(p);
      parts.push_back({area, std::move(ring), box});
    }
  }
  std::sort(parts.begin(), parts.end(),
            [](const NestedPart& a, const NestedPart& b) { return a.area < b.area; });
  std::vector<Polygon> polygons(parts.size());
  for (Ring2& hole : holes) {
    const auto around = std::find_if(parts.begin(), parts.end(), [&](const NestedPart& part) {
      return parts.size() == 1 ||
             (part.box.contains(hole.front()) && geometry::inside(part.outer, hole.front()));
    });
    if (around == parts.end()) return {};
    polygons[static_cast<std::size_t>(around - parts.begin())].holes.push_back(std::move(hole));
  }
  for (std::size_t i = 0; i < parts.size(); ++i) polygons[i].outer = std::move(parts[i].outer);
  return polygons;
}

}  // namespace

std::optional<std::vector<Polygon>> bounded_by(const InsetLines& lines, std::span<const Rest> rests) {
  std::optional<std::vector<Ring2>> rings = rings_of(lines, rests);
  if (!rings) return {};
  return nested(std::move(*rings));
}

}  // namespace octosurf::planning
