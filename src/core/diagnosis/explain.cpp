#include "alignment/alignment_state.hpp"
#include "diagnosis/pending_reasons.hpp"
#include "diagnosis/refusal_text.hpp"
#include "geometry/even_odd.hpp"

#include <algorithm>
#include <cmath>

#include <octosurf/error.hpp>
#include <octosurf/explain.hpp>

namespace octosurf {
namespace {

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
  result.sentence = diagnosis::sentence_of(refusal);
  result.surface = refusal.surface;
  result.cylinder = refusal.cylinder;
  result.figures = diagnosis::figures_of(refusal);
}

void explain_pending(const surfaces::MapState& state, const occupancy::VoxelPoint& point,
                     const detection::Detector* paper, Explanation& result) {
  const diagnosis::PendingReasons reasons(state, point.key, paper);
  state_reason(reasons.of(point.key), result);
  result.around = reasons.within(state.parameters.max_hole_size(), result.asked);
}

std::string scans_of(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " scan" : " scans") + (count == 1 ? " was" : " were");
}

/// Scans excluded for their poses that might have created a surface here, and those that may have prevented
/// one.
void explain_poses(const alignment::AlignmentState& alignment, Explanation& result) {
  for (const alignment::AlignmentState::Misfit& misfit : alignment.misfits)
    if ((misfit.position - result.asked).norm() <= misfit.reach_m)
      ++(misfit.left_out ? result.scans_left_out : result.scans_unexplained);
  if (result.reason == Reason::on_surface || result.reason == Reason::on_cylinder) return;
  if (result.scans_left_out > 0)
    result.sentence += "; " + scans_of(result.scans_left_out) +
                       " left out that may have seen it, because the pose was far off the map";
  if (result.scans_unexplained > 0 && result.looked_at)
    result.sentence += "; " + scans_of(result.scans_unexplained) +
                       " mapped near here though the pose fits nowhere, and may have doubled surfaces here";
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
  explain_poses(alignment::record_of(state).state, result);
  return result;
}

}  // namespace octosurf
