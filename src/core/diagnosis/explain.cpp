#include "detection/detector.hpp"
#include "detection/seed_patches.hpp"
#include "detection/voxel_blocks.hpp"
#include "geometry/even_odd.hpp"
#include "surfaces/cells.hpp"
#include "surfaces/refusal.hpp"

#include <algorithm>
#include <array>
#include <boost/algorithm/string/replace.hpp>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/explain.hpp>

namespace octosurf {
namespace {

struct ReasonText {
  /// {measured} and {limit} are replaced by the figure's value and its lower bound, {surface} and {cylinder}
  /// by ids.
  std::string_view sentence;
  std::string_view figure{}, unit{};  // name and unit of the Figure; empty: none
};
/// By Reason.
constexpr std::array<ReasonText, reason_names.size()> reason_texts{
    {{"There is a surface here: surface {surface}."},
     {"No surface: this is in a hole of surface {surface}."},
     {"No surface: the nearest point belongs to surface {surface}, and this is outside its polygons."},
     {"No surface: this is on cylinder {cylinder}."},
     {"No surface: this is outside what the octree can hold."},
     {"No surface: nothing was ever seen here."},
     {"No surface: this is free space."},
     {"No surface: the voxel here is occupied, but no scan has put a point into it."},
     {"No surface: the point here stands alone, with fewer than two others within r."},
     {"No surface: only {measured} points on the plane here lie less than h apart, and a surface "
      "needs {limit}.",
      "points"},
     {"No surface: the patch here is {measured} m wide, and a surface needs {limit} m.", "width", "m"},
     {"No surface: the patch here was seen along its plane, at a mean cosine of {measured}; below "
      "{limit} its side is not known.",
      "cosine"},
     {"No surface: the patch here is curved, like a pillar's side."},
     {"No surface: what was seen here was seen through surface {surface} and is its noise."},
     {"No surface: no plane passes through the point here that enough others beside it agree on: an "
      "edge, something round, or clutter."},
     {"No surface: the plane through the points here explains less of what is seen around it than "
      "clutter does ({measured} nats, and a surface needs more than {limit}).",
      "explained", "nats"},
     {"Not yet a surface: a look around here would make one, but comes only once enough new points "
      "have."}}};

const ReasonText& text_of(Reason reason) { return reason_texts.at(static_cast<std::size_t>(reason)); }

std::string digits_of(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.begin(), text.end(), value, std::chars_format::general, 3).ptr};
}

/// The reason's sentence with its numbers and ids filled in.
std::string sentence_of(const surfaces::Refusal& refusal) {
  using boost::algorithm::replace_all;
  std::string sentence(text_of(refusal.reason).sentence);
  replace_all(sentence, "{measured}", digits_of(refusal.measured));
  replace_all(sentence, "{limit}", digits_of(refusal.limit));
  replace_all(sentence, "{surface}", std::to_string(refusal.surface));
  replace_all(sentence, "{cylinder}", std::to_string(refusal.cylinder));
  return sentence;
}

/// The number behind it, if any.
std::vector<Figure> figures_of(const surfaces::Refusal& refusal) {
  const ReasonText& told = text_of(refusal.reason);
  if (told.figure.empty() || (refusal.measured == 0 && refusal.limit == 0)) return {};
  return {Figure{std::string(told.figure), refusal.measured, std::string(told.unit), refusal.limit}};
}

/// The reasons why points are pending: repeats detection among all points connected with a place, as the next
/// scan with enough points would, and records the result for every point. The map does not change.
class PendingReasons {
 public:
  /// `state` must not change meanwhile.
  PendingReasons(const surfaces::MapState& state, geometry::VoxelKey place, const detection::Detector* paper);

  /// For a pending point near the place; Reason::waiting if it would now get a surface.
  surfaces::Refusal of(geometry::VoxelKey key) const;
  /// Numbers of pending points within `radius` (m) of `at` by reason.
  std::map<Reason, std::size_t> within(double radius, const Eigen::Vector3d& at) const;

 private:
  void collect_pending(geometry::VoxelKey place);
  bool stands_alone(geometry::VoxelKey key) const;

  surfaces::LoadedView view_;
  std::vector<PointId> pending_;
  std::map<PointId, surfaces::Refusal> reasons_;
};

PendingReasons::PendingReasons(const surfaces::MapState& state, geometry::VoxelKey place,
                               const detection::Detector* paper)
    : view_(state) {
  collect_pending(place);
  reasons_ = detection::detector_of(state.parameters, paper).refusals(view_, pending_);
}

/// Block by block from those around the place, while neighbours have pending points, too.
void PendingReasons::collect_pending(geometry::VoxelKey place) {
  constexpr std::size_t most_points = 20000;  // effort: a tenth of a second
  const int edge = detection::seed_patch_edge(view_.parameters.occupancy.resolution);
  const detection::VoxelBlocks blocks(edge);
  std::set<detection::VoxelBlocks::Place> known{blocks.of(place)};
  std::deque<detection::VoxelBlocks::Place> waiting(known.begin(), known.end());
  for (; !waiting.empty() && pending_.size() < most_points; waiting.pop_front()) {
    const std::size_t before = pending_.size();
    blocks.for_each_point(view_.window, waiting.front(), [&](PointId i) {
      if (view_.window[i].surface == 0) pending_.push_back(i);
    });
    if (pending_.size() == before) continue;
    for (const detection::VoxelBlocks::Place next : blocks.widened({waiting.front()}, edge))
      if (known.insert(next).second) waiting.push_back(next);
  }
  view_.window.put_in_order(pending_);
}

surfaces::Refusal PendingReasons::of(geometry::VoxelKey key) const {
  if (const CylinderId cylinder = view_.cylinders.owner(key); cylinder != 0)
    return {.reason = Reason::on_cylinder, .cylinder = cylinder};
  const auto found = reasons_.find(view_.window.find(key));
  if (found != reasons_.end() && found->second.reason == Reason::waiting) return found->second;
  if (stands_alone(key)) return {Reason::isolated};
  return found == reasons_.end() ? surfaces::Refusal{Reason::no_plane} : found->second;
}

bool PendingReasons::stands_alone(geometry::VoxelKey key) const {
  const double radius = view_.parameters.search_radius();
  const Eigen::Vector3f at = view_.window[view_.window.find(key)].position;
  const auto is_near = [&](PointId other) {
    return (view_.window[other].position - at).cast<double>().norm() <= radius;
  };
  return std::count_if(pending_.begin(), pending_.end(), is_near) < 3;  // itself, and fewer than two others
}

std::map<Reason, std::size_t> PendingReasons::within(double radius, const Eigen::Vector3d& at) const {
  std::map<Reason, std::size_t> counts;
  for (const PointId i : pending_)
    if ((view_.window[i].position.cast<double>() - at).norm() <= radius)
      ++counts[of(view_.window[i].key).reason];
  return counts;
}

/// The point nearest to `at` within `radius`; the lower key wins a tie.
std::optional<occupancy::VoxelPoint> nearest_point(const occupancy::OccupancyMap& occupancy,
                                                   geometry::VoxelKey key, const Eigen::Vector3d& at,
                                                   double radius) {
  const occupancy::PointWindow window(occupancy);
  std::optional<occupancy::VoxelPoint> best;
  double nearest = radius;
  const int reach = static_cast<int>(std::ceil(radius / occupancy.grid().resolution()));
  window.for_each_near(key, reach, [&](PointId i) {
    const occupancy::VoxelPoint& p = window[i];
    const double distance = (p.position.cast<double>() - at).norm();
    if (distance > nearest || (best && distance == nearest && best->key < p.key)) return;
    nearest = distance;
    best = p;
  });
  return best;
}

/// The surface with the nearest inlier; the lower id wins a tie.
void find_nearest_surface(const surfaces::MapState& state, Explanation& result) {
  double nearest_sq = std::numeric_limits<double>::infinity();
  for (const auto& [id, surface] : state.surfaces)
    surface.for_each_inlier([&, surface_id = id](const surfaces::Inlier& inlier) {
      const double distance_sq = (inlier.position.cast<double>() - result.asked).squaredNorm();
      if (distance_sq >= nearest_sq) return;
      nearest_sq = distance_sq;
      result.nearest = surface_id;
      result.nearest_distance = std::sqrt(distance_sq);
    });
}

/// The place projected along the surface's normal: on it, in a hole, or beside it.
Reason place_on(const Surface& surface, const Eigen::Vector3d& at) {
  const Eigen::Vector2d uv = (surface.T_map_surface.inverse() * at).head<2>();
  Reason place = Reason::beside_surface;
  for (const Polygon& polygon : surface.polygons) {
    if (!geometry::inside(polygon.outer, uv)) continue;
    const bool in_hole = std::any_of(polygon.holes.begin(), polygon.holes.end(),
                                     [&](const Ring2& hole) { return geometry::inside(hole, uv); });
    if (!in_hole) return Reason::on_surface;
    place = Reason::in_hole;  // unless on an island in it
  }
  return place;
}

/// The surface with the nearest plane within s that contains `at` in its outline or a hole.
std::optional<std::pair<SurfaceId, Reason>> surface_around(const surfaces::MapState& state,
                                                           const Eigen::Vector3d& at) {
  std::optional<std::pair<SurfaceId, Reason>> found;
  double nearest = std::max(state.parameters.surface_tolerance(), state.parameters.occupancy.resolution);
  const std::shared_ptr<const Snapshot> snapshot = state.snapshot.read();
  for (const SurfacePtr& surface : snapshot->surfaces) {
    const double distance = std::fabs(surface->plane.signed_distance(at));
    if (distance > nearest) continue;
    const Reason place = place_on(*surface, at);
    if (place == Reason::beside_surface) continue;
    if (found && found->second == Reason::on_surface && place == Reason::in_hole) continue;
    nearest = distance;
    found.emplace(surface->id, place);
  }
  return found;
}

void state_reason(const surfaces::Refusal& refusal, Explanation& result) {
  result.reason = refusal.reason;
  result.sentence = sentence_of(refusal);
  result.surface = refusal.surface;
  result.cylinder = refusal.cylinder;
  result.figures = figures_of(refusal);
}

void explain_pending(const surfaces::MapState& state, const occupancy::VoxelPoint& point,
                     const detection::Detector* paper, Explanation& result) {
  const PendingReasons reasons(state, point.key, paper);
  state_reason(reasons.of(point.key), result);
  result.around = reasons.within(state.parameters.max_hole_size(), result.asked);
}

}  // namespace

Explanation explain(const Map& map, const Eigen::Vector3d& point, const detection::Detector* paper) {
  if (!point.allFinite()) throw Error(Error::Kind::usage, "explain", "the point is not finite");
  const surfaces::MapState& state = surfaces::state_of(map);
  Explanation result;
  result.asked = point;
  geometry::VoxelKey key;
  if (!state.occupancy.grid().key_of(point.cast<float>(), key)) {
    state_reason({Reason::outside_map}, result);
    return result;
  }
  find_nearest_surface(state, result);
  const std::optional<occupancy::VoxelPoint> nearest =
      nearest_point(state.occupancy, key, point, state.parameters.max_hole_size());
  if (nearest) result.looked_at = nearest->position.cast<double>();

  const auto around = surface_around(state, point);
  const bool pending = nearest && nearest->surface == 0;
  if (around && (around->second == Reason::on_surface || !pending)) {
    state_reason({.reason = around->second, .surface = around->first}, result);
  } else if (pending) {
    explain_pending(state, *nearest, paper, result);
  } else if (nearest) {
    const Reason place = place_on(*state.snapshot.read()->find(nearest->surface), point);
    state_reason({.reason = place, .surface = nearest->surface}, result);
  } else {
    const occupancy::OccupancyMap::State here = state.occupancy.at(key).state;
    state_reason({here == occupancy::OccupancyMap::State::unknown ? Reason::unseen
                  : here == occupancy::OccupancyMap::State::free  ? Reason::free_space
                                                                  : Reason::no_point},
                 result);
  }
  return result;
}

}  // namespace octosurf
