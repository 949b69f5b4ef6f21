#include "surfaces/upkeep.hpp"

#include "surfaces/planarity.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf {
namespace {

/// Largest distance between two planes over the surface's own extent.
double displacement(const SurfaceModel& surface, const Plane& a, const Plane& b) {
  const Moments m = surface.moments(nullptr);
  const double reach = 2 * std::sqrt(std::max(0.0, m.covariance().trace()));
  const Eigen::Vector3d centre = surface.reference() + m.mean();
  return std::fabs(a.signed_distance(centre) - b.signed_distance(centre)) +
         reach * (a.normal - b.normal).norm();
}

Plane fitted_plane(const Moments& moments, const Eigen::Vector3d& reference, const Eigen::Vector3d& toward) {
  const PlaneFit fit = fit_plane(moments);
  Plane plane{fit.normal, 0};
  if (plane.normal.dot(toward) < 0) plane.normal = -plane.normal;
  plane.offset = plane.normal.dot(reference + fit.centroid);
  return plane;
}

void dissolve(Workspace& work, SurfaceModel& surface) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) work.take_back(work.window.find(inlier.key));
  work.state.surfaces.erase(id);
  work.changes.gone.insert(id);
}

bool too_small(const Workspace& work, const SurfaceModel& surface) {
  return surface.size() < static_cast<std::size_t>(work.state.parameters.min_surface_points());
}

/// A surface that a few far points made, or that has crept around a pillar, is found out once it has
/// changed by a quarter: closer views leave less to noise. Large ones have proved themselves.
bool no_longer_planar(Workspace& work, SurfaceModel& surface) {
  constexpr std::size_t proved = 20000;
  if (surface.size() > proved || surface.unchecked * 4 < surface.size()) return false;
  surface.unchecked = 0;
  Planarity planarity(surface.pose());
  for (const Inlier& inlier : surface.sorted_inliers())
    planarity.add(inlier.position, work.state.noise.sigma(inlier.range_class),
                  work.state.noise.tolerance(inlier.range_class),
                  surface.surrounded(surface.cell_of(inlier.position)));
  // Not its scatter: voxels that noise reached once count as much as those it hits each time.
  return planarity.bends();
}

/// Inliers that a moved plane has left behind, with half a tolerance of patience.
void drop_misfits(Workspace& work, SurfaceModel& surface) {
  std::vector<VoxelKey> misfits;
  surface.for_each_inlier([&](const Inlier& inlier) {
    if (std::fabs(surface.distance(inlier.position)) > 1.5 * work.state.noise.tolerance(inlier.range_class))
      misfits.push_back(inlier.key);
  });
  std::sort(misfits.begin(), misfits.end());
  for (const VoxelKey key : misfits) work.take_back(work.window.find(key));
  surface.checked_plane = surface.plane();
}

}  // namespace

void retract(Workspace& work, const OccupancyDelta& delta) {
  MapState& state = work.state;
  for (const VoxelPoint& p : delta.vanished) {
    if (p.surface == 0) continue;
    SurfaceModel* surface = state.surfaces.find(p.surface);
    if (surface != nullptr && state.surfaces.remove(*surface, p.key, p.position))
      work.changes.shrunk.insert(p.surface);
  }
  for (const OccupancyDelta::Refined& r : delta.refined) {
    if (r.before.surface == 0) {
      work.returned.push_back(r.after.key);  // seen better, it may make a plane now
      continue;
    }
    SurfaceModel* surface = state.surfaces.find(r.before.surface);
    if (surface == nullptr) continue;
    state.surfaces.remove(*surface, r.before.key, r.before.position);
    const PointWindow::Index i = work.window.find(r.after.key);
    if (std::fabs(surface->distance(r.after.position)) <= state.noise.tolerance(r.after.range_class)) {
      work.give(i, *surface);
    } else {
      work.window.assign(i, 0);
      work.returned.push_back(r.after.key);
      work.changes.shrunk.insert(r.before.surface);
    }
  }
  for (const SurfaceId id : work.changes.touched())
    if (SurfaceModel& surface = *state.surfaces.find(id); too_small(work, surface)) dissolve(work, surface);
}

void refit(Workspace& work) {
  MapState& state = work.state;
  const double patience = state.parameters.surface_tolerance() / 4;
  for (const SurfaceId id : work.changes.touched()) {
    SurfaceModel& surface = *state.surfaces.find(id);
    const Plane plane =
        fitted_plane(surface.moments(&state.noise), surface.reference(), surface.plane().normal);
    state.surfaces.set_plane(surface, plane);
    if (displacement(surface, plane, surface.checked_plane) > patience) drop_misfits(work, surface);
    surface.rehash_if_tilted();
    if (too_small(work, surface)) {
      dissolve(work, surface);
    } else if (state.parameters.aligned() && no_longer_planar(work, surface)) {
      // Its points are settled: the same plane would only be found again.
      const std::size_t returned = work.returned.size();
      dissolve(work, surface);
      work.returned.resize(returned);
    }
  }
}

bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise) {
  constexpr double cos_10_deg = 0.984807753012208;
  if (a.plane().normal.dot(b.plane().normal) < cos_10_deg) return false;
  Moments joint = b.moments(&noise).shifted(a.reference() - b.reference());
  joint.add(a.moments(&noise));
  const Plane plane = fitted_plane(joint, a.reference(), a.plane().normal);
  const auto fits = [&](const SurfaceModel& s) {
    const Moments m = s.moments(&noise);
    const double offset = plane.offset - plane.normal.dot(s.reference());
    const double own_offset = s.plane().offset - s.plane().normal.dot(s.reference());
    const double rms = std::sqrt(m.mean_squared_distance(plane.normal, offset));
    const double own = std::sqrt(m.mean_squared_distance(s.plane().normal, own_offset));
    // A plane is left by at most a third of the reach of its typical point.
    return rms <= own + noise.tolerance(1) / 3;
  };
  return fits(a) && fits(b);
}

void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from) {
  MapState& state = work.state;
  const SurfaceId gone = from.id();
  for (const Inlier& inlier : from.sorted_inliers()) {
    const PointWindow::Index i = work.window.find(inlier.key);
    state.surfaces.remove(from, inlier.key, inlier.position);
    work.give(i, into);
  }
  into.parents().push_back(gone);
  state.surfaces.erase(gone);
  work.changes.merged.insert(gone);
}

void derive(Workspace& work) {
  MapState& state = work.state;
  ++state.revision;
  const std::shared_ptr<const Snapshot> before = std::atomic_load(&state.snapshot);
  auto next = std::make_shared<Snapshot>(Snapshot{state.revision, before->resolution, {}});
  const std::set<SurfaceId> touched = work.changes.touched();
  for (auto& [id, surface] : state.surfaces) {
    if (!touched.contains(id)) {
      const auto at = std::lower_bound(before->surfaces.begin(), before->surfaces.end(), id,
                                       [](const SurfacePtr& s, SurfaceId wanted) { return s->id < wanted; });
      next->surfaces.push_back(*at);
      continue;
    }
    surface.derive(state.parameters.max_hole_size());
    surface.revision = state.revision;
    next->surfaces.push_back(surface.publish(state.revision));
  }
  next->cylinders = state.cylinders.publish(state.revision);
  std::atomic_store(&state.snapshot, std::shared_ptr<const Snapshot>(std::move(next)));
}

}  // namespace octosurf
