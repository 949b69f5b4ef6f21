#include "geometry/ring_check.hpp"

#include "geometry/rings.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <algorithm>
#include <set>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::geometry {
namespace {

using Index = std::uint32_t;

constexpr std::int32_t outside = -1;

struct Edge {
  Eigen::Vector2d left, right;
  Index ring;
  std::int32_t below, above;  ///< polygon below and above the edge, or outside
};

/// Side of c as seen along a → b: left 1, on the line 0, right -1. Exact.
int orientation(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const auto point = [](const Eigen::Vector2d& p) { return CGAL::Epick::Point_2(p.x(), p.y()); };
  return static_cast<int>(CGAL::orientation(point(a), point(b), point(c)));
}

/// The edge that starts further right decides by its left end; if both start in one point, the right ends.
bool runs_below(const Edge& a, const Edge& b) {
  if (is_before(b.left, a.left)) {
    const int s = orientation(b.left, b.right, a.left);
    return s != 0 ? s < 0 : orientation(b.left, b.right, a.right) < 0;
  }
  const int s = orientation(a.left, a.right, b.left);
  return s != 0 ? s > 0 : orientation(a.left, a.right, b.right) > 0;
}

/// The sweep of Shamos and Hoey (1976): edges in their order along a line that moves from left to right; the
/// first two that intersect are neighbours just before. It ends at the first fault, up to which the order is
/// valid.
class Sweep {
 public:
  explicit Sweep(std::span<const Polygon> polygons) {
    for (std::size_t p = 0; p < polygons.size(); ++p) {
      add_ring(polygons[p].outer, static_cast<std::int32_t>(p));
      for (const Ring2& hole : polygons[p].holes) add_ring(hole, static_cast<std::int32_t>(p));
    }
    places_.resize(edges_.size(), status_.end());
  }

  std::optional<std::string_view> operator()() {
    std::vector<Event> events;
    events.reserve(2 * edges_.size());
    for (Index i = 0; i < edges_.size(); ++i) {
      events.push_back({edges_[i].left, i});
      events.push_back({edges_[i].right, i});
    }
    std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
      return a.at == b.at ? a.edge < b.edge : is_before(a.at, b.at);
    });
    for (std::size_t begin = 0, end = 0; begin < events.size(); begin = end) {
      while (end < events.size() && events[end].at == events[begin].at) ++end;
      if (const auto fault = pass(std::span(events).subspan(begin, end - begin))) return fault;
    }
    return {};
  }

 private:
  struct Event {
    Eigen::Vector2d at;
    Index edge;
  };
  struct Order {
    using is_transparent = void;
    const std::vector<Edge>* edges;
    bool operator()(Index a, Index b) const { return runs_below((*edges)[a], (*edges)[b]); }
    bool operator()(Index a, const Eigen::Vector2d& p) const {
      return orientation((*edges)[a].left, (*edges)[a].right, p) > 0;
    }
  };
  using Status = std::set<Index, Order>;

  void add_ring(const Ring2& ring, std::int32_t polygon) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
      // The interior is on the left of the ring's direction.
      edges_.push_back(is_before(a, b) ? Edge{a, b, rings_, outside, polygon}
                                       : Edge{b, a, rings_, polygon, outside});
    }
    ++rings_;
  }

  /// Whether the edges have anything in common besides a shared end.
  bool meet(const Edge& a, const Edge& b) const {
    if (a.right == b.right || a.left == b.left || a.right == b.left || b.right == a.left)
      return a.left == b.left ? orientation(a.left, a.right, b.right) == 0
                              : a.right == b.right && orientation(a.left, a.right, b.left) == 0;
    return orientation(a.left, a.right, b.left) * orientation(a.left, a.right, b.right) <= 0 &&
           orientation(b.left, b.right, a.left) * orientation(b.left, b.right, a.right) <= 0;
  }

  /// The region between two neighbours of the status, either of which may be missing, must be the same
  /// polygon for both.
  std::optional<std::string_view> compare(Status::iterator lower, Status::iterator upper) const {
    const Edge* a = lower == status_.end() ? nullptr : &edges_[*lower];
    const Edge* b = upper == status_.end() ? nullptr : &edges_[*upper];
    if (a != nullptr && b != nullptr && meet(*a, *b)) return "rings that cross";
    if ((a != nullptr ? a->above : outside) != (b != nullptr ? b->below : outside))
      return "a ring that runs the wrong way or lies in the wrong place";
    return {};
  }

  std::optional<std::string_view> check_rings_at(std::span<const Event> here) {
    rings_here_.clear();
    for (const Event& event : here) rings_here_.push_back(edges_[event.edge].ring);
    std::sort(rings_here_.begin(), rings_here_.end());
    for (std::size_t i = 2; i < rings_here_.size(); ++i)
      if (rings_here_[i] == rings_here_[i - 2]) return "a ring that comes to a vertex twice";
    return {};
  }

  /// The sweep passes a point where edges end and begin.
  std::optional<std::string_view> pass(std::span<const Event> here) {
    if (const auto fault = check_rings_at(here)) return fault;
    const Eigen::Vector2d& at = here.front().at;
    for (const Event& event : here)
      if (edges_[event.edge].right == at) status_.erase(places_[event.edge]);
    const auto above = status_.lower_bound(at);
    if (above != status_.end() && orientation(edges_[*above].left, edges_[*above].right, at) == 0)
      return "a vertex on an edge";
    auto lower = above == status_.begin() ? status_.end() : std::prev(above);
    for (const Event& event : here) {
      if (edges_[event.edge].left != at) continue;
      const auto [place, alone] = status_.insert(event.edge);
      if (!alone) return "edges that run along each other";
      places_[event.edge] = place;
    }
    for (auto upper = lower == status_.end() ? status_.begin() : std::next(lower);; ++upper) {
      if (const auto fault = compare(lower, upper)) return fault;
      if (upper == above) return {};
      lower = upper;
    }
  }

  std::vector<Edge> edges_;
  Index rings_ = 0;
  Status status_{Order{&edges_}};
  std::vector<Status::iterator> places_;
  std::vector<Index> rings_here_;
};

bool sound_alone(const Ring2& ring, bool outer) {
  return ring.size() >= 3 && (signed_area(ring) > 0) == outer;
}

}  // namespace

std::optional<std::string_view> fault_of(std::span<const Polygon> polygons) {
  for (const Polygon& polygon : polygons) {
    const auto finite = [](const Ring2& ring) {
      return std::all_of(ring.begin(), ring.end(), [](const Eigen::Vector2d& p) { return p.allFinite(); });
    };
    if (!finite(polygon.outer) || !std::all_of(polygon.holes.begin(), polygon.holes.end(), finite))
      return "a vertex that is not finite";
  }
  if (const auto fault = Sweep(polygons)()) return fault;
  for (const Polygon& polygon : polygons) {
    const auto hole = [](const Ring2& ring) { return sound_alone(ring, false); };
    if (!sound_alone(polygon.outer, true) || !std::all_of(polygon.holes.begin(), polygon.holes.end(), hole))
      return "a ring that runs the wrong way or has fewer than three vertices";
  }
  return {};
}

void require_polygons(std::span<const Polygon> polygons, const std::string& where) {
  if (const auto fault = fault_of(polygons))
    throw Error(Error::Kind::data, where, "has " + std::string(*fault),
                "rings must be simple, outer ones counter-clockwise, holes clockwise and inside");
}

}  // namespace octosurf::geometry
