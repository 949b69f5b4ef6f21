#include "planning/stairs/steps.hpp"

#include "geometry/directions.hpp"
#include "geometry/symmetric.hpp"
#include "planning/polygon_index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include <octosurf/up.hpp>

namespace octosurf::planning {
namespace {

// Steeper, half a foot (0.12 m) on it would already rise or fall by nearly half of the least riser.
constexpr double level_slope_rad = 10 * std::numbers::pi / 180;
// From a kerb's lowered side to the highest riser that people climb without hands.
constexpr double least_riser = 0.05, greatest_riser = 0.30;
// Search distance before an edge for the lower surface: nearly half a foot, so that treads of half a foot
// count; then up to a foot, for treads whose back is unseen, behind their own front or below a nosing.
constexpr std::array before_edge{0.10, 0.175, 0.25};
// Narrower than two feet side by side is no step.
constexpr double least_step_width = 0.30;
// Outlines are ragged by a voxel; their direction is read over the length of half a foot.
constexpr double sample_spacing = 0.02;
constexpr int half_window = 3;
// A straight edge of many samples errs by far less; corners of a worn or rounded edge stay within it.
constexpr double facing_cos = 0.82;  // 35°
constexpr double edge_depth = 0.04;  // m, of the band that holds one edge
// Parts of one edge: at most the search distance apart; turned by less than two winders, as worn edges are
// round; as equal in height as risers of a flight.
constexpr double part_gap = 0.10, part_cos = 0.97, part_height = riser_tolerance;

struct Level {
  const Surface* surface;
  PolygonIndex polygons;
  Eigen::Isometry3d T_surface_up, T_up_surface;
  Eigen::AlignedBox2d box;  // of the outline, upright

  Level(const Surface& s, const Eigen::Quaterniond& turn)
      : surface(&s),
        polygons(s.polygons),
        T_surface_up((turn * s.T_map_surface).inverse()),
        T_up_surface(turn * s.T_map_surface) {
    const Eigen::AlignedBox3d all = box_of(s, T_up_surface);
    box = {all.min().head<2>(), all.max().head<2>()};
  }
  double height(const Eigen::Vector2d& at) const {
    const Eigen::Vector3d normal = T_up_surface.linear().col(2);
    return T_up_surface.translation().z() -
           normal.head<2>().dot(at - T_up_surface.translation().head<2>()) / normal.z();
  }
  bool contains(const Eigen::Vector2d& at) const {
    if (!box.contains(at)) return false;
    return polygons.contains((T_surface_up * Eigen::Vector3d(at.x(), at.y(), height(at))).head<2>());
  }
  /// At the middle of a foot that stands at the edge, or of a tread that is shallower: worn fronts and backs
  /// that run up into the next riser lean its plane, which errs least there and most at the edge.
  double height_beside(const Eigen::Vector2d& edge, const Eigen::Vector2d& away) const {
    double first = 0, depth = 0;
    while (first < before_edge.back() && !contains(edge + first * away)) first += sample_spacing;
    while (depth < before_edge.back() && contains(edge + (first + depth) * away)) depth += sample_spacing;
    return height(edge + (depth > 0 ? first + depth / 2 : 0) * away);
  }
};

struct EdgeSample {
  Eigen::Vector2d at, outward;
  bool adjoins = false;  // the lower surface is seen right before it
};

/// Places along a ring `spacing` apart, with the smoothed direction out of the surface.
void sample_outline(const Level& level, const Ring2& ring, std::vector<EdgeSample>& samples) {
  std::vector<Eigen::Vector2d> places;
  double left = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const auto upright = [&](const Eigen::Vector2d& uv) -> Eigen::Vector2d {
      return (level.T_up_surface * Eigen::Vector3d(uv.x(), uv.y(), 0)).head<2>();
    };
    const Eigen::Vector2d from = upright(ring[i]), to = upright(ring[(i + 1) % ring.size()]);
    const double length = (to - from).norm();
    for (; left < length; left += sample_spacing) places.push_back(from + left / length * (to - from));
    left -= length;
  }
  const std::size_t n = places.size();
  if (n < 2 * half_window + 1) return;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d along = places[(i + half_window) % n] - places[(i + n - half_window) % n];
    if (along.norm() < sample_spacing) continue;  // a spike
    samples.push_back({places[i], Eigen::Vector2d(along.y(), -along.x()).normalized(), false});
  }
}

/// The samples that face one way in one line; taken out of `rest`.
std::vector<EdgeSample> take_edge(std::vector<EdgeSample>& rest) {
  // The heading that most others share, counted in sectors of 10° with both neighbours.
  constexpr int sectors = 36;
  std::array<int, sectors> count{};
  const auto sector_of = [](const Eigen::Vector2d& v) {
    const double turn = std::atan2(v.y(), v.x()) / (2 * std::numbers::pi);
    return static_cast<int>((turn - std::floor(turn)) * sectors) % sectors;
  };
  for (const EdgeSample& s : rest) ++count[static_cast<std::size_t>(sector_of(s.outward))];
  int best = 0, best_count = -1;
  const auto around = [&](int i) { return count[static_cast<std::size_t>((i + sectors) % sectors)]; };
  for (int i = 0; i < sectors; ++i) {
    const int here = around(i - 1) + around(i) + around(i + 1);
    if (here > best_count) best = i, best_count = here;
  }
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const EdgeSample& s : rest) {
    const int off = (sector_of(s.outward) - best + sectors) % sectors;
    if (off <= 1 || off == sectors - 1) mean += s.outward;
  }
  mean.normalize();
  // Of those, the line with the most.
  std::vector<double> offsets;
  for (const EdgeSample& s : rest)
    if (s.outward.dot(mean) > facing_cos) offsets.push_back(s.at.dot(mean));
  std::sort(offsets.begin(), offsets.end());
  std::size_t first = 0, most = 0;
  double line = 0;
  for (std::size_t last = 0; last < offsets.size(); ++last) {
    while (offsets[last] - offsets[first] > edge_depth) ++first;
    if (last - first + 1 > most) most = last - first + 1, line = offsets[(first + last) / 2];
  }
  std::vector<EdgeSample> edge, others;
  for (const EdgeSample& s : rest)
    // Wide sideways, so that a slanted edge is not split.
    (s.outward.dot(mean) > facing_cos && std::fabs(s.at.dot(mean) - line) < 2 * edge_depth ? edge : others)
        .push_back(s);
  if (edge.empty()) others.clear();
  rest = std::move(others);
  return edge;
}

/// A line through the samples, those farther off than half a voxel and more left out the second time.
struct EdgeLine {
  Eigen::Vector2d middle, along;
  double low = 0, high = 0;  // extent along it, from the middle
  explicit EdgeLine(std::vector<EdgeSample> edge) {
    for (int round = 0; round < 3; ++round) {
      Eigen::Vector2d mean = Eigen::Vector2d::Zero(), outward = mean;
      for (const EdgeSample& s : edge) mean += s.at, outward += s.outward;
      mean /= static_cast<double>(edge.size());
      Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
      for (const EdgeSample& s : edge) spread += (s.at - mean) * (s.at - mean).transpose();
      along = geometry::principal_axes(spread).vectors.col(1);
      if (along.dot(Eigen::Vector2d(-outward.y(), outward.x())) < 0) along = -along;
      const Eigen::Vector2d across(along.y(), -along.x());
      std::vector<double> off;
      for (const EdgeSample& s : edge) off.push_back(std::fabs(across.dot(s.at - mean)));
      std::vector<double> sorted = off;
      std::sort(sorted.begin(), sorted.end());
      const double limit = std::max(2.5 * sorted[sorted.size() / 2], 1e-6);
      std::vector<EdgeSample> kept;
      for (std::size_t i = 0; i < edge.size(); ++i)
        if (off[i] <= limit) kept.push_back(edge[i]);
      middle = mean;
      if (kept.size() < edge.size() / 2 || kept.size() == edge.size()) break;
      edge = std::move(kept);
    }
    for (const EdgeSample& s : edge) extend_to(s.at);
    recentre();
  }

  /// To the corners, where the outline's smoothed direction turns away: the line's own is taken there.
  void widen(const std::vector<EdgeSample>& samples, const Level& upper, const Level& lower) {
    const Eigen::Vector2d outward(along.y(), -along.x());
    const double from = low - before_edge.front(), to = high + before_edge.front();
    for (const EdgeSample& s : samples) {
      const double place = along.dot(s.at - middle);
      if (place < from || place > to || std::fabs(outward.dot(s.at - middle)) > edge_depth) continue;
      const auto before = [&](double distance) {
        const Eigen::Vector2d at = s.at + distance * outward;
        return lower.contains(at) && !upper.contains(at);
      };
      // At the narrow end of a winder the tread below is no deeper than this.
      if (before(edge_depth) || std::any_of(before_edge.begin(), before_edge.end(), before)) extend_to(s.at);
    }
    recentre();
  }

 private:
  void extend_to(const Eigen::Vector2d& at) {
    const double place = along.dot(at - middle);
    low = std::min(low, place);
    high = std::max(high, place);
  }
  void recentre() {
    middle += (low + high) / 2 * along;
    high = (high - low) / 2;
    low = -high;
  }
};

/// What follows from the ends.
void measure(UprightStep& step) {
  const Eigen::Vector2d along = (step.ends[1] - step.ends[0]).head<2>();
  step.middle = (step.ends[0] + step.ends[1]).head<2>() / 2;
  step.heading = Eigen::Vector2d(-along.y(), along.x()).normalized();
  step.step.width_m = along.norm();
  step.step.heading_rad = std::atan2(step.heading.y(), step.heading.x());
}

/// Whether `part` continues `step`'s edge, in one line and height.
bool continues(const UprightStep& step, const UprightStep& part) {
  if (step.heading.dot(part.heading) < part_cos) return false;
  if (std::fabs(step.step.riser_m - part.step.riser_m) > part_height) return false;
  const Eigen::Vector3d along = step.ends[1] - step.ends[0];
  const auto place = [&](const Eigen::Vector3d& at) {
    return (at - step.ends[0]).head<2>().dot(along.head<2>()) / along.head<2>().squaredNorm();
  };
  // Its end that is nearer, and what the step's line has there.
  const Eigen::Vector3d& end = part.ends[place(part.ends[0]) + place(part.ends[1]) > 1 ? 0 : 1];
  const double at = place(end), beyond = std::max(at - 1, -at) * step.step.width_m;
  const Eigen::Vector3d off = end - (step.ends[0] + at * along);
  return beyond < part_gap && off.head<2>().norm() < 2 * edge_depth && std::fabs(off.z()) < part_height;
}

void absorb(UprightStep& step, const UprightStep& part) {
  const double own = step.step.width_m, its = part.step.width_m;
  step.step.riser_m = (own * step.step.riser_m + its * part.step.riser_m) / (own + its);
  step.adjoins = own > its ? step.adjoins : part.adjoins;
  const auto across = [&](const Eigen::Vector3d& at) {
    return at.head<2>().dot(Eigen::Vector2d(step.heading.y(), -step.heading.x()));
  };
  if (across(part.ends[0]) < across(step.ends[0])) step.ends[0] = part.ends[0];
  if (across(part.ends[1]) > across(step.ends[1])) step.ends[1] = part.ends[1];
  add_ids(part.lower, step.lower);
  add_ids(part.upper, step.upper);
  measure(step);
}

/// Edges of treads that were mapped in parts side by side become one again, the widest first.
std::vector<UprightStep> join_parts(std::vector<UprightStep> parts) {
  std::stable_sort(parts.begin(), parts.end(), [](const UprightStep& a, const UprightStep& b) {
    return a.step.width_m > b.step.width_m;
  });
  std::vector<UprightStep> joined;
  while (!parts.empty()) {
    UprightStep& step = joined.emplace_back(std::move(parts.front()));
    parts.erase(parts.begin());
    for (std::size_t i = 0; i < parts.size();) {
      if (!continues(step, parts[i])) {
        ++i;
        continue;
      }
      absorb(step, parts[i]);
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(i));
      i = 0;  // it may reach others now
    }
  }
  return joined;
}

std::vector<Level> level_surfaces(const Snapshot& snapshot, const Eigen::Vector3d& up) {
  const Eigen::Quaterniond turn = upright(up);
  std::vector<Level> levels;
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (!surface->polygons.empty() && slope_rad(*surface, up) <= level_slope_rad)
      levels.emplace_back(*surface, turn);
  return levels;
}

/// The highest of the levels near a sample of an outline's edge, just before it; none where one at about the
/// same height continues the outline's.
struct Before {
  const Level* level = nullptr;
  bool adjoins = false;  ///< it begins right there
};

Before level_before(const EdgeSample& sample, const Level& upper, const std::vector<const Level*>& near) {
  const double height = upper.height(sample.at);
  for (const double distance : before_edge) {
    const Eigen::Vector2d before = sample.at + distance * sample.outward;
    if (upper.contains(before)) break;
    const Level* lower = nullptr;
    double highest = height - greatest_riser;
    for (const Level* other : near) {
      const double its = other->height(before);
      if (its < highest || its > height + least_riser || !other->contains(before)) continue;
      lower = other;
      highest = its;
    }
    if (lower == nullptr) continue;
    if (highest > height - least_riser) break;
    return {lower, distance == before_edge.front()};
  }
  return {};
}

/// The step along an edge between two levels. `samples`: of the upper one's outline.
UprightStep step_along(const std::vector<EdgeSample>& edge, const std::vector<EdgeSample>& samples,
                       const Level& upper, const Level& lower) {
  EdgeLine line(edge);
  line.widen(samples, upper, lower);
  UprightStep step;
  const auto adjoining = std::ranges::count_if(edge, [](const EdgeSample& e) { return e.adjoins; });
  step.adjoins = 2 * adjoining >= std::ssize(edge);
  step.step.lower = lower.surface->id;
  step.step.upper = upper.surface->id;
  step.lower = {step.step.lower};
  step.upper = {step.step.upper};
  const Eigen::Vector2d outward(line.along.y(), -line.along.x());
  step.step.riser_m = upper.height_beside(line.middle, -outward) - lower.height_beside(line.middle, outward);
  for (std::size_t end = 0; end < 2; ++end) {
    // Left of the heading is against the ring's course.
    const Eigen::Vector2d at = line.middle + (end == 0 ? line.low : line.high) * line.along;
    step.ends[end] << at, upper.height(at);
  }
  measure(step);
  return step;
}

/// Adds those from a level down to others.
void add_steps_down(const Level& upper, const std::vector<const Level*>& near,
                    std::vector<UprightStep>& steps) {
  std::vector<EdgeSample> samples;
  for_each_ring(upper.surface->polygons, [&](const Ring2& ring) { sample_outline(upper, ring, samples); });
  std::map<SurfaceId, std::pair<const Level*, std::vector<EdgeSample>>> edges;  // by the lower surface
  for (const EdgeSample& sample : samples)
    if (const auto [level, adjoins] = level_before(sample, upper, near); level != nullptr) {
      edges[level->surface->id].first = level;
      edges[level->surface->id].second.push_back({sample.at, sample.outward, adjoins});
    }
  for (auto& [id, found] : edges) {
    auto& [lower, rest] = found;
    while (static_cast<double>(rest.size()) * sample_spacing >= least_step_width) {
      const std::vector<EdgeSample> edge = take_edge(rest);
      if (static_cast<double>(edge.size()) * sample_spacing < least_step_width) continue;
      const UprightStep step = step_along(edge, samples, upper, *lower);
      const double riser = step.step.riser_m;
      if (step.step.width_m >= least_step_width && riser >= least_riser && riser <= greatest_riser)
        steps.push_back(step);
    }
  }
}

}  // namespace

void add_ids(const std::vector<SurfaceId>& added, std::vector<SurfaceId>& ids) {
  for (const SurfaceId id : added)
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
}

std::vector<UprightStep> find_steps(const Snapshot& snapshot, const Eigen::Vector3d& up) {
  geometry::require_direction(up, "up");
  const std::vector<Level> levels = level_surfaces(snapshot, up);
  const Eigen::Quaterniond turn = upright(up);
  std::vector<UprightStep> steps;
  for (const Level& upper : levels) {
    const Eigen::AlignedBox2d reach = box_about(upper.box, before_edge.back());
    std::vector<const Level*> near;
    for (const Level& other : levels)
      if (&other != &upper && other.box.intersects(reach)) near.push_back(&other);
    if (!near.empty()) add_steps_down(upper, near, steps);
  }
  steps = join_parts(std::move(steps));
  std::sort(steps.begin(), steps.end(), [](const UprightStep& a, const UprightStep& b) {
    return std::tie(a.step.upper, a.step.lower, a.middle.x(), a.middle.y()) <
           std::tie(b.step.upper, b.step.lower, b.middle.x(), b.middle.y());
  });
  for (UprightStep& step : steps)
    for (std::size_t end = 0; end < 2; ++end) step.step.edge[end] = turn.conjugate() * step.ends[end];
  return steps;
}

}  // namespace octosurf::planning
