#include "upkeep/revise.hpp"

#include "geometry/planarity.hpp"
#include "surfaces/criteria/parts.hpp"
#include "surfaces/criteria/soundness.hpp"

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

std::vector<Workspace::Index> indices_of(Workspace& work, const SurfaceModel& surface) {
  std::vector<Workspace::Index> indices;
  indices.reserve(surface.size());
  for (const Inlier& inlier : surface.sorted_inliers()) indices.push_back(work.window.find(inlier.key));
  return indices;
}

bool bends(const Workspace& work, const SurfaceModel& surface, std::span<const Workspace::Index> points) {
  Planarity planarity(surface.pose());
  for (const Workspace::Index i : points) {
    const VoxelPoint& p = work.window[i];
    planarity.add(p.position, work.state.noise.sigma(p.range_class),
                  work.state.noise.tolerance(p.range_class), surface.surrounded(surface.cell_of(p.position)));
  }
  // Not its scatter: voxels that noise reached once count as much as those it hits each time.
  return planarity.bends();
}

/// The largest part keeps the id. What is too little for a surface of its own stays with it.
void split(Workspace& work, SurfaceModel& surface, std::vector<std::vector<Workspace::Index>> parts) {
  const auto largest = std::max_element(parts.begin(), parts.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const auto fewest = static_cast<std::size_t>(work.state.parameters.min_surface_points());
  surface.forget_evidence();  // it spoke of all parts together
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    if (part == largest || part->size() < fewest) continue;
    SurfaceModel& own = work.state.surfaces.create(fitted(work, *part, surface.plane()),
                                                   work.window[part->front()].position.cast<double>());
    own.parents().push_back(surface.id());
    for (const Workspace::Index i : *part) {
      work.take_back(i);
      work.returned.pop_back();  // it has an owner again at once
      work.give(i, own);
    }
    work.changes.born.insert(own.id());
  }
  // The plane it was refitted to lay between the parts.
  work.state.surfaces.set_plane(
      surface, fitted_plane(surface.moments(&work.state.noise), surface.reference(), surface.plane().normal));
  surface.rehash_if_tilted();
}

/// A surface that a few far points made, that has crept around a pillar or over two blocks, or that is
/// the noise of one found later, is found out once it has changed by a quarter: closer views leave less
/// to noise. False if it is none.
bool still_sound(Workspace& work, SurfaceModel& surface) {
  // What its neighbours have taken it down to, with some patience.
  const double width = width_of(surface.moments(nullptr));
  const double least = 0.8 * work.state.parameters.surfaces.min_surface_width;
  const auto unsound = [&](const Unsound& why) {
    work.changes.unsound[surface.id()] = why;
    return false;
  };
  if (width < least) return unsound({Unsound::Why::narrow, width, least});
  if (surface.settled()) return true;
  surface.unchecked = 0;
  const std::vector<Workspace::Index> points = indices_of(work, surface);
  if (bends(work, surface, points)) return unsound({Unsound::Why::bent});
  const Sheet sheet = sheet_of(work, points, surface.plane(), surface.id());
  if (sheet.covers_much_of(points.size())) return unsound({Unsound::Why::sheet, 0, 0, sheet.over});
  if (sheet.points.size() * 20 > points.size()) {
    const std::size_t returned = work.returned.size();
    for (const Workspace::Index i : sheet.points) work.take_back(i);
    work.returned.resize(returned);  // they would only be found again
    return !too_small(work, surface) || unsound({Unsound::Why::sheet, 0, 0, sheet.over});
  }
  std::vector<std::vector<Workspace::Index>> parts = parts_of(work, points, surface.plane());
  if (parts.size() > 1) split(work, surface, std::move(parts));
  return true;
}

/// Inliers that a moved plane has left behind, with half a tolerance of patience.
void drop_misfits(Workspace& work, SurfaceModel& surface) {
  const NoiseModel& noise = work.state.noise;
  std::vector<VoxelKey> misfits;
  surface.for_each_inlier([&](const Inlier& inlier) {
    const double distance = std::fabs(surface.distance(inlier.position));
    if (distance <= 1.5 * noise.base_tolerance()) return;  // nearly all
    const VoxelPoint& p = work.window[work.window.find(inlier.key)];
    if (distance > 1.5 * noise.tolerance(p, surface.plane())) misfits.push_back(inlier.key);
  });
  std::sort(misfits.begin(), misfits.end());
  for (const VoxelKey key : misfits) work.take_back(work.window.find(key));
  surface.checked_plane = surface.plane();
}

}  // namespace

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
      const auto n = static_cast<double>(state.parameters.min_surface_points());
      work.changes.unsound[id] = {Unsound::Why::few, static_cast<double>(surface.size()), n};
      dissolve(work, surface);
    } else if (state.parameters.aligned() && !still_sound(work, surface)) {
      // Its points are settled: the same plane would only be found again.
      const std::size_t returned = work.returned.size();
      dissolve(work, surface);
      work.returned.resize(returned);
    }
  }
}

}  // namespace octosurf
