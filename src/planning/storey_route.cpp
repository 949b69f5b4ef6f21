#include "planning/storey_ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/storeys.hpp>

namespace octosurf {
namespace {

/// m: search distance sideways for a stair's landing, half a stair's usual width.
constexpr double beside_landing_m = 0.5;
constexpr std::size_t none = ~std::size_t{0};

/// Where the middle of the robot may be in a storey.
class Room {
 public:
  Room(const Storey& storey, const StoreyLimits& limits)
      : storey_(storey), room_(planning::room_in(storey)), radius_(limits.radius_m / storey.cell_m) {}

  bool fits(std::size_t cell) const { return static_cast<double>(room_[cell]) >= radius_; }
  /// The nearest place at its height where the robot fits.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& place, double reach_m, double step_m) const {
    std::optional<std::size_t> best;
    double nearest = reach_m;
    for (std::size_t cell = 0; cell < storey_.cells.size(); ++cell) {
      const double off = (storey_.center_of(cell) - place.head<2>()).norm();
      if (off > nearest || !fits(cell) || std::fabs(storey_.elevation[cell] - place.z()) > step_m) continue;
      nearest = off;
      best = cell;
    }
    return best;
  }
  Eigen::Vector3d at(std::size_t cell) const {
    const Eigen::Vector2d middle = storey_.center_of(cell);
    return {middle.x(), middle.y(), storey_.elevation[cell]};
  }
  std::size_t cell_of(const Eigen::Vector3d& at) const { return *storey_.cell_at(at.head<2>()); }
  /// The cell before each on the shortest way from one, over the eight beside; `none` where there is no way.
  std::vector<std::size_t> ways_from(std::size_t start) const;
  /// Whether the robot fits along a straight line.
  bool sees(std::size_t from, std::size_t to) const;
  /// The corners of the way that `ways` has to a cell, both ends included.
  std::vector<std::size_t> corners(const std::vector<std::size_t>& ways, std::size_t to) const;

 private:
  const Storey& storey_;
  std::vector<float> room_;
  double radius_;
};

std::vector<std::size_t> Room::ways_from(std::size_t start) const {
  std::vector<std::size_t> before(storey_.cells.size(), none);
  std::vector<double> length(storey_.cells.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<std::pair<double, std::size_t>, std::vector<std::pair<double, std::size_t>>,
                      std::greater<>>
      next;
  length[start] = 0;
  before[start] = start;
  next.emplace(0, start);
  const auto columns = static_cast<std::ptrdiff_t>(storey_.columns);
  while (!next.empty()) {
    const auto [way, cell] = next.top();
    next.pop();
    if (way > length[cell]) continue;
    for (const std::ptrdiff_t y : {-columns, std::ptrdiff_t{0}, columns})
      for (const std::ptrdiff_t x : {-1, 0, 1}) {
        const auto beside = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + x + y);
        if (beside == cell || !fits(beside)) continue;  // free cells are not at the grid's rim
        const double longer = way + (x != 0 && y != 0 ? std::sqrt(2.0) : 1);
        if (longer >= length[beside]) continue;
        length[beside] = longer;
        before[beside] = cell;
        next.emplace(longer, beside);
      }
  }
  return before;
}

bool Room::sees(std::size_t from, std::size_t to) const {
  const Eigen::Vector2d a = storey_.center_of(from), b = storey_.center_of(to);
  const double steps = std::ceil(4 * (b - a).norm() / storey_.cell_m);  // a quarter of a cell each
  for (double k = 1; k < steps; ++k)
    if (!fits(*storey_.cell_at(a + k / steps * (b - a)))) return false;
  return true;
}

std::vector<std::size_t> Room::corners(const std::vector<std::size_t>& ways, std::size_t to) const {
  std::vector<std::size_t> way{to};
  while (ways[way.back()] != way.back()) way.push_back(ways[way.back()]);
  std::reverse(way.begin(), way.end());
  std::vector<std::size_t> kept{way.front()};
  for (std::size_t i = 0; i + 1 < way.size();) {
    std::size_t farthest = i + 1;
    for (std::size_t k = way.size() - 1; k > farthest; --k)
      if (sees(way[i], way[k])) farthest = k;
    kept.push_back(way[i = farthest]);
  }
  return kept;
}

/// Collects the graph.
class Router {
 public:
  Router(const GroundView& view, const std::vector<Storey>& storeys, const StoreyLimits& limits)
      : stairs_(view.stairs().stairs), storeys_(storeys), limits_(limits) {
    for (const Storey& storey : storeys) rooms_.emplace_back(storey, limits);
  }

  StoreyRoute route() {
    for (std::size_t i = 0; i < stairs_.size(); ++i) add_stair(i);
    for (std::size_t a = 0; a < storeys_.size(); ++a)
      for (const auto& [b, at] : storeys_[a].seams)
        if (b > a) add_seam(a, b, at);
    const std::size_t ends = route_.nodes.size();
    for (std::size_t i = 0; i < ends; ++i) add_ways(i, ends);
    return std::move(route_);
  }

 private:
  /// Adds the node nearest to a place, in whatever storey; `none` without one.
  std::size_t add_node(RoutePlace kind, const Eigen::Vector3d& place, std::size_t only = none) {
    RouteNode node{kind, none, {}};
    double nearest = beside_landing_m;
    for (std::size_t i = 0; i < rooms_.size(); ++i) {
      if (only != none && i != only) continue;
      const auto cell = rooms_[i].nearest(place, nearest, limits_.max_step_m);
      if (!cell) continue;
      node.at = rooms_[i].at(*cell);
      node.storey = i;
      nearest = (node.at - place).head<2>().norm();
    }
    if (node.storey == none) return none;
    route_.nodes.push_back(node);
    return route_.nodes.size() - 1;
  }

  void add_both(RouteEdge edge) {
    // An edge of length 0 is an error in graph searches.
    edge.length_m = std::max(edge.length_m, limits_.cell_m);
    route_.edges.push_back(edge);
    std::swap(edge.from, edge.to);
    edge.up = false;
    if (edge.stair) {
      const Step& last = stairs_[*edge.stair].steps.back();
      edge.heading_rad = std::remainder(last.heading_rad + std::numbers::pi, 2 * std::numbers::pi);
    }
    std::reverse(edge.over_stair.begin(), edge.over_stair.end());
    route_.edges.push_back(std::move(edge));
  }

  void add_stair(std::size_t index) {
    const Stair& stair = stairs_[index];
    std::array<std::size_t, 2> ends{none, none};
    const std::size_t before = route_.nodes.size();
    for (const bool above : {false, true})
      if (const auto landing = planning::landing_of(stair, above, limits_))
        ends[above ? 1 : 0] = add_node(RoutePlace::landing, *landing);
    if (ends[0] == none || ends[1] == none) {
      route_.nodes.resize(before);
      route_.without_landing.push_back(index);
      return;
    }
    RouteEdge edge{ends[0], ends[1], 0, index, true, stair.steps.front().heading_rad, {}};
    Eigen::Vector3d at = route_.nodes[ends[0]].at;
    for (const Step& step : stair.steps) {
      edge.over_stair.push_back(planning::middle_of(step, limits_));
      edge.length_m += (edge.over_stair.back() - at).norm();
      at = edge.over_stair.back();
    }
    edge.length_m += (route_.nodes[ends[1]].at - at).norm();
    add_both(std::move(edge));
  }

  void add_seam(std::size_t a, std::size_t b, const Eigen::Vector3d& at) {
    const std::size_t before = route_.nodes.size(), from = add_node(RoutePlace::seam, at, a),
                      to = add_node(RoutePlace::seam, at, b);
    if (from == none || to == none) return route_.nodes.resize(before);
    add_both({from, to, (route_.nodes[from].at - route_.nodes[to].at).norm()});
  }

  /// From one of the first `ends` nodes to those behind it in its storey.
  void add_ways(std::size_t from, std::size_t ends) {
    const RouteNode start = route_.nodes[from];
    const Room& room = rooms_[start.storey];
    std::vector<std::size_t> ways;
    for (std::size_t to = from + 1; to < ends; ++to) {
      const RouteNode goal = route_.nodes[to];
      if (goal.storey != start.storey) continue;
      if (ways.empty()) ways = room.ways_from(room.cell_of(start.at));
      if (ways[room.cell_of(goal.at)] == none) continue;
      const std::vector<std::size_t> corners = room.corners(ways, room.cell_of(goal.at));
      std::size_t last = from;
      for (std::size_t k = 1; k < std::max<std::size_t>(corners.size(), 2); ++k) {
        std::size_t next = to;
        if (k + 1 < corners.size()) {
          next = route_.nodes.size();
          route_.nodes.push_back({RoutePlace::way, start.storey, room.at(corners[k])});
        }
        add_both({last, next, (route_.nodes[next].at - route_.nodes[last].at).norm()});
        last = next;
      }
    }
  }

  const std::vector<Stair>& stairs_;
  const std::vector<Storey>& storeys_;
  const StoreyLimits& limits_;
  std::vector<Room> rooms_;
  StoreyRoute route_;
};

}  // namespace

void planning::require(const StoreyLimits& limits) {
  const auto refuse = [](const char* what, const char* is, const char* hint) {
    throw Error(Error::Kind::usage, what, is, hint);
  };
  if (!(limits.cell_m > 0 && limits.cell_m <= 1)) refuse("cell_m", "must be in (0, 1]", "take 0.05");
  if (!(limits.radius_m > 0 && limits.radius_m <= 5))
    refuse("radius_m", "must be in (0, 5]", "give the radius of the robot's footprint");
  if (!(limits.max_step_m > 0 && limits.max_step_m <= 1))
    refuse("max_step_m", "must be in (0, 1]", "give the robot's highest step on the way");
  if (!(limits.headroom_m > limits.max_step_m && limits.headroom_m <= 5))
    refuse("headroom_m", "must be above max_step_m and at most 5", "give the robot's height");
  if (!(limits.min_area_m2 >= 0)) refuse("min_area_m2", "must be at least 0", "take 4");
  if (!(std::fabs(limits.turn.norm() - 1) < 1e-6)) refuse("turn", "is no rotation", "take upright(up)");
}

Eigen::Vector3d planning::middle_of(const Step& step, const StoreyLimits& limits) {
  return limits.turn * ((step.edge[0] + step.edge[1]) / 2);
}

std::optional<Eigen::Vector3d> planning::landing_of(const Stair& stair, bool above,
                                                    const StoreyLimits& limits) {
  if ((above ? stair.landing_above : stair.landing_below) == 0) return {};
  const Step& step = above ? stair.steps.back() : stair.steps.front();
  const double off = (limits.radius_m + limits.cell_m) * (above ? 1 : -1);
  const Eigen::Vector3d ahead(std::cos(step.heading_rad), std::sin(step.heading_rad), 0);
  return middle_of(step, limits) + off * ahead - Eigen::Vector3d(0, 0, above ? 0 : step.riser_m);
}

std::vector<float> planning::room_in(const Storey& storey) {
  const Eigen::Vector2i size(static_cast<int>(storey.columns), static_cast<int>(storey.rows));
  Mask occupied(storey.cells.size());
  std::transform(storey.cells.begin(), storey.cells.end(), occupied.begin(),
                 [](StoreyCell cell) { return static_cast<std::uint8_t>(cell == StoreyCell::occupied); });
  std::vector<float> room = CellRaster(Eigen::Vector2i::Zero(), size, storey.cell_m).distance_to(occupied);
  for (std::size_t cell = 0; cell < room.size(); ++cell)
    if (storey.cells[cell] != StoreyCell::free) room[cell] = 0;
  return room;
}

StoreyRoute find_route(const GroundView& view, const std::vector<Storey>& storeys,
                       const StoreyLimits& limits) {
  planning::require(limits);
  return Router(view, storeys, limits).route();
}

}  // namespace octosurf
