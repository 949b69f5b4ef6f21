#include "geometry/median.hpp"
#include "planning/stairs/steps.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include <octosurf/queries.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/up.hpp>

namespace octosurf {
namespace {

using planning::add_ids;
using planning::riser_tolerance;
using planning::UprightStep;

constexpr double code_tolerance = 0.01;  // m, see riser_tolerance
// 3°: treads are level or fall by 2 % (1.1°), and a narrow one's plane seen from one side errs by 1°.
constexpr double parallel_cos = 0.9986;
// Two risers and a tread are one pace, 0.60 to 0.65 m: a deeper tread needs another pace and is a landing.
constexpr double deepest_tread = 0.60;
// Half a foot: the least tread.
constexpr double least_tread = 0.15;
// A winder turns a quarter turn in two or three treads.
constexpr double greatest_turn = 50 * std::numbers::pi / 180;
// A landing's way from one flight to the next: two flights side by side and the gap between them.
constexpr double longest_landing = 3.0;
// A surface at an end is a landing once it is clearly more than one tread.
constexpr double treads_of_landing = 1.5;
// Headings of a straight stair's edges, partly seen ones of half a metre included, err by less.
constexpr double straight_turn = 12 * std::numbers::pi / 180;
constexpr double least_spiral_turn = 6 * std::numbers::pi / 180;

double turn_of(const UprightStep& from, const UprightStep& to) {
  const Eigen::Vector2d &a = from.heading, &b = to.heading;
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

Eigen::Vector2d common_heading(const UprightStep& from, const UprightStep& to) {
  return (from.heading + to.heading).normalized();
}

/// Between the front edges' middles, along the heading between theirs.
double tread_depth(const UprightStep& from, const UprightStep& to) {
  return common_heading(from, to).dot(to.middle - from.middle);
}

/// How unlike two steps of one flight the second is to the first; empty: it does not follow it.
std::optional<double> unlike(const UprightStep& from, const UprightStep& to) {
  const double rise = std::fabs(to.step.riser_m - from.step.riser_m);
  const double turn = std::fabs(turn_of(from, to));
  if (rise > riser_tolerance || turn > greatest_turn) return {};
  const double run = tread_depth(from, to);
  if (run < least_tread || run > deepest_tread) return {};
  // The narrower edge lies for its greater part behind the other.
  const Eigen::Vector2d heading = common_heading(from, to), across(-heading.y(), heading.x());
  const double half_from = from.step.width_m / 2, half_to = to.step.width_m / 2;
  const double aside = std::fabs(across.dot(to.middle - from.middle));
  const double shared = std::min(half_from, aside + half_to) - std::max(-half_from, aside - half_to);
  if (shared < std::min(half_from, half_to)) return {};
  return rise / riser_tolerance + turn / greatest_turn + aside / (half_from + half_to);
}

using Pairs = std::vector<std::tuple<double, std::size_t, std::size_t>>;  // cost, first, second

/// The numbers below `count` in chains: each is followed by at most one, the cheapest pairs first. Pairs must
/// not lead back: every step rises.
std::vector<std::vector<std::size_t>> chains(std::size_t count, Pairs pairs) {
  std::sort(pairs.begin(), pairs.end());
  const std::size_t none_yet = count;
  std::vector<std::size_t> next(count, none_yet), previous(count, none_yet);
  for (const auto& [cost, i, k] : pairs)
    if (next[i] == none_yet && previous[k] == none_yet) next[i] = k, previous[k] = i;
  std::vector<std::vector<std::size_t>> found;
  for (std::size_t first = 0; first < count; ++first) {
    if (previous[first] != none_yet) continue;
    std::vector<std::size_t>& chain = found.emplace_back();
    for (std::size_t i = first; i != none_yet; i = next[i]) chain.push_back(i);
  }
  return found;
}

using Flight = std::vector<std::size_t>;  // indices of steps, from below

/// The steps in flights, the most alike pairs first.
std::vector<Flight> flights(const std::vector<UprightStep>& steps) {
  std::map<SurfaceId, std::vector<std::size_t>> by_lower;
  for (std::size_t i = 0; i < steps.size(); ++i)
    for (const SurfaceId id : steps[i].lower) by_lower[id].push_back(i);
  Pairs pairs;
  for (std::size_t i = 0; i < steps.size(); ++i)
    for (const SurfaceId id : steps[i].upper)
      if (const auto next = by_lower.find(id); next != by_lower.end())
        for (const std::size_t k : next->second)
          if (const auto cost = unlike(steps[i], steps[k])) pairs.emplace_back(*cost, i, k);
  return chains(steps.size(), std::move(pairs));
}

double mean_riser(const std::vector<UprightStep>& steps, const Flight& flight) {
  double sum = 0;
  for (const std::size_t i : flight) sum += steps[i].step.riser_m;
  return sum / static_cast<double>(flight.size());
}

bool share_any(const std::vector<SurfaceId>& a, const std::vector<SurfaceId>& b) {
  return std::any_of(a.begin(), a.end(),
                     [&](SurfaceId id) { return std::find(b.begin(), b.end(), id) != b.end(); });
}

/// Joins flights of two steps or more that share a landing, the nearest first.
std::vector<Flight> join_at_landings(const std::vector<UprightStep>& steps, std::vector<Flight> all) {
  Pairs pairs;
  for (std::size_t a = 0; a < all.size(); ++a)
    for (std::size_t b = 0; b < all.size(); ++b) {
      if (a == b || all[a].size() < 2 || all[b].size() < 2) continue;
      const UprightStep &end = steps[all[a].back()], &start = steps[all[b].front()];
      if (!share_any(end.upper, start.lower)) continue;
      if (std::fabs(mean_riser(steps, all[a]) - mean_riser(steps, all[b])) > riser_tolerance) continue;
      const double way = (start.middle - end.middle).norm();
      if (way <= longest_landing) pairs.emplace_back(way, a, b);
    }
  std::vector<Flight> joined;
  for (const std::vector<std::size_t>& chain : chains(all.size(), std::move(pairs))) {
    Flight& flight = joined.emplace_back();
    for (const std::size_t f : chain) flight.insert(flight.end(), all[f].begin(), all[f].end());
  }
  return joined;
}

MeanLength spread_of(const std::vector<double>& lengths) {
  MeanLength result;
  if (lengths.empty()) return result;
  for (const double length : lengths) result.mean_m += length / static_cast<double>(lengths.size());
  for (const double length : lengths)
    result.std_m += std::pow(length - result.mean_m, 2) / static_cast<double>(lengths.size());
  result.std_m = std::sqrt(result.std_m);
  return result;
}

/// Parents of all surfaces, of removed ones too.
std::map<SurfaceId, std::vector<SurfaceId>> parents_of(const Snapshot& snapshot) {
  std::map<SurfaceId, std::vector<SurfaceId>> parents;
  const auto add = [&](SurfaceId id, const std::vector<SurfaceId>& those) {
    auto& list = parents[id];
    list.insert(list.end(), those.begin(), those.end());
  };
  for (const SurfacePtr& surface : snapshot.surfaces) add(surface->id, surface->parents);
  snapshot.removals.for_each_since(0, [&](const Removal& removal) {
    if (removal.of != Removal::Of::surface) return;
    add(removal.id, removal.parents);
    if (removal.into != 0) add(removal.into, {removal.id});
  });
  return parents;
}

SurfaceId oldest_ancestor(const std::map<SurfaceId, std::vector<SurfaceId>>& parents,
                          const std::vector<SurfaceId>& ids) {
  std::set<SurfaceId> seen(ids.begin(), ids.end());
  std::vector<SurfaceId> open(ids);
  while (!open.empty()) {
    const SurfaceId id = open.back();
    open.pop_back();
    if (const auto its = parents.find(id); its != parents.end())
      for (const SurfaceId parent : its->second)
        if (seen.insert(parent).second) open.push_back(parent);
  }
  return *seen.begin();
}

StairKind stair_kind(const std::vector<UprightStep>& steps, const Flight& flight) {
  bool straight = true, spiral = flight.size() > 2;
  for (std::size_t k = 1; k < flight.size(); ++k) {
    const double turn = turn_of(steps[flight[k - 1]], steps[flight[k]]);
    const double from_first = turn_of(steps[flight[0]], steps[flight[k]]);
    straight = straight && std::fabs(turn) < straight_turn && std::fabs(from_first) < straight_turn;
    const double first = turn_of(steps[flight[0]], steps[flight[1]]);
    spiral =
        spiral && std::fabs(turn) > least_spiral_turn && std::fabs(turn) < greatest_turn && turn * first > 0;
  }
  return straight ? StairKind::straight : spiral ? StairKind::spiral : StairKind::turning;
}

/// Two risers may be any two things, stones on a floor or across gaps: they count where they are as a builder
/// makes them. Three and more of equal height are no chance.
bool is_built(const Snapshot& snapshot, const std::vector<UprightStep>& steps, const Flight& flight) {
  if (flight.size() != 2) return flight.size() > 2;
  const auto parallel = [&](const Step& step) {
    return snapshot.find(step.lower)->plane.normal.dot(snapshot.find(step.upper)->plane.normal) >
           parallel_cos;
  };
  const UprightStep &first = steps[flight[0]], &second = steps[flight[1]];
  return first.adjoins && second.adjoins && parallel(first.step) && parallel(second.step) &&
         std::fabs(first.step.riser_m - second.step.riser_m) <= code_tolerance;
}

Eigen::Vector3d common_normal(const Snapshot& snapshot, const std::vector<SurfaceId>& treads) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceId id : treads) sum += snapshot.find(id)->area_m2 * snapshot.find(id)->plane.normal;
  return sum.normalized();
}

/// As tread_depth(), but along the treads: where `up` is 2° off, a riser of 17 cm would shift it by 6 mm.
double depth_along_treads(const Step& from, const Step& to, const Eigen::Vector3d& normal) {
  const auto heading = [&](const Step& step) -> Eigen::Vector3d {
    return normal.cross(step.edge[1] - step.edge[0]).normalized();
  };
  const Eigen::Vector3d way = (to.edge[0] + to.edge[1] - from.edge[0] - from.edge[1]) / 2;
  return (heading(from) + heading(to)).normalized().dot(way);
}

Stair describe(const Snapshot& snapshot, const std::vector<UprightStep>& steps, const Flight& flight) {
  Stair stair;
  stair.kind = stair_kind(steps, flight);
  std::vector<double> risers, treads, widths;
  for (const std::size_t i : flight) {
    stair.steps.push_back(steps[i].step);
    risers.push_back(steps[i].step.riser_m);
    widths.push_back(steps[i].step.width_m);
  }
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  for (const std::size_t i : flight) heading += steps[i].step.width_m * steps[i].heading;
  if (stair.kind != StairKind::straight) heading = steps[flight[0]].heading;
  stair.heading_rad = std::atan2(heading.y(), heading.x());
  for (std::size_t k = 1; k < flight.size(); ++k) {
    stair.turn_rad += turn_of(steps[flight[k - 1]], steps[flight[k]]);
    add_ids(steps[flight[k - 1]].upper, stair.treads);
    add_ids(steps[flight[k]].lower, stair.treads);
  }
  const Eigen::Vector3d normal = common_normal(snapshot, stair.treads);
  for (std::size_t k = 1; k < flight.size(); ++k)
    if (unlike(steps[flight[k - 1]], steps[flight[k]]))
      treads.push_back(depth_along_treads(stair.steps[k - 1], stair.steps[k], normal));
  stair.riser = spread_of(risers);
  stair.tread = spread_of(treads);
  stair.width_m = geometry::median_of(widths);
  const double landing_m2 = treads_of_landing * stair.tread.mean_m * stair.width_m;
  // A level's largest surface where it is a landing, else 0 and its parts are treads.
  const auto landing = [&](const std::vector<SurfaceId>& level, std::vector<SurfaceId>& to) {
    const auto area = [&](SurfaceId id) { return snapshot.find(id)->area_m2; };
    double sum = 0;
    for (const SurfaceId id : level) sum += area(id);
    if (sum > landing_m2)
      return *std::max_element(level.begin(), level.end(),
                               [&](SurfaceId a, SurfaceId b) { return area(a) < area(b); });
    add_ids(level, to);
    return SurfaceId{0};
  };
  std::vector<SurfaceId> from_below;
  stair.landing_below = landing(steps[flight.front()].lower, from_below);
  add_ids(stair.treads, from_below);
  stair.landing_above = landing(steps[flight.back()].upper, from_below);
  stair.treads = std::move(from_below);
  return stair;
}

}  // namespace

Stairs find_stairs(const Snapshot& snapshot, const Eigen::Vector3d& up) {
  const std::vector<UprightStep> steps = planning::find_steps(snapshot, up);
  Stairs found;
  if (steps.empty()) return found;
  const auto parents = parents_of(snapshot);
  std::set<SurfaceId> of_stairs;
  for (const Flight& flight : join_at_landings(steps, flights(steps))) {
    if (!is_built(snapshot, steps, flight)) continue;
    Stair stair = describe(snapshot, steps, flight);
    stair.id = oldest_ancestor(parents, stair.treads);
    for (const SurfaceId tread : stair.treads) of_stairs.insert(tread);
    found.stairs.push_back(std::move(stair));
  }
  std::sort(found.stairs.begin(), found.stairs.end(),
            [](const Stair& a, const Stair& b) { return a.id < b.id; });
  const auto on_stair = [&](SurfaceId id) { return of_stairs.contains(id); };
  // A tread's sides are no steps of their own.
  for (const UprightStep& step : steps)
    if (step.adjoins && std::none_of(step.upper.begin(), step.upper.end(), on_stair) &&
        std::none_of(step.lower.begin(), step.lower.end(), on_stair))
      found.single_steps.push_back(step.step);
  return found;
}

const Stair* nearest_stair(const Snapshot& snapshot, const std::vector<Stair>& stairs,
                           const Eigen::Vector3d& point) {
  const auto stair_of = [&](SurfaceId id) {
    return std::find_if(stairs.begin(), stairs.end(), [id](const Stair& stair) {
      return std::find(stair.treads.begin(), stair.treads.end(), id) != stair.treads.end();
    });
  };
  auto treads = std::make_shared<Snapshot>();
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (stair_of(surface->id) != stairs.end()) treads->surfaces.push_back(surface);
  const std::optional<Nearest> found = SurfaceIndex(treads).nearest(point);
  return found ? &*stair_of(found->id) : nullptr;
}

}  // namespace octosurf
