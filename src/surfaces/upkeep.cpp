#include "surfaces/upkeep.hpp"

#include "occupancy/payload.hpp"
#include "surfaces/parts.hpp"
#include "surfaces/planarity.hpp"
#include "surfaces/soundness.hpp"

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

enum class Points { requeued, released };

/// `released`: for points that detection has nothing new to say about; it would find the same plane again.
void dissolve(Workspace& work, SurfaceModel& surface, Points points) {
  const SurfaceId id = surface.id();
  for (const Inlier& inlier : surface.sorted_inliers()) {
    const Workspace::Index i = work.window.find(inlier.key);
    points == Points::requeued ? work.requeue(i) : work.release(i);
  }
  work.state.surfaces.erase(id);
  work.changes.gone.insert(id);
}

bool too_small(const Workspace& work, const SurfaceModel& surface) {
  return surface.size() < static_cast<std::size_t>(work.state.parameters.min_surface_points());
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
  // Its scatter is not checked: a voxel that noise reached once counts as much as one hit by every scan.
  return planarity.bends();
}

/// The largest part keeps the id, and the parts that are too small for a surface of their own.
void split(Workspace& work, SurfaceModel& surface, std::vector<std::vector<Workspace::Index>> parts) {
  const auto largest = std::max_element(parts.begin(), parts.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const auto fewest = static_cast<std::size_t>(work.state.parameters.min_surface_points());
  surface.forget_evidence();  // it mixes readings of all parts
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    if (part == largest || part->size() < fewest) continue;
    SurfaceModel& own = work.state.surfaces.create(fitted(work, *part, surface.plane()),
                                                   work.window[part->front()].position.cast<double>());
    own.parents().push_back(surface.id());
    for (const Workspace::Index i : *part) work.reassign(i, own);
    work.changes.born.insert(own.id());
  }
  // The plane it was refitted to lay between the parts.
  surface.set_plane(
      fitted_plane(surface.moments(&work.state.noise), surface.reference(), surface.plane().normal));
  surface.rehash_if_tilted();
}

/// Checks a surface that has changed by a quarter for being one plane, and splits it if it is several. A
/// surface may turn out to be none when closer views have less noise: if a few far points made it, if it has
/// grown around a pillar or over two blocks, or if it is the noise of one found later. False if it is none.
bool still_sound(Workspace& work, SurfaceModel& surface) {
  // Neighbours may have taken points from it. A known surface may be a fifth narrower than a new one.
  const double width = width_of(surface.moments(nullptr));
  const double least = 0.8 * work.state.parameters.surfaces.min_surface_width;
  const auto unsound = [&](const Refusal& why) {
    work.changes.unsound[surface.id()] = why;
    return false;
  };
  if (width < least) return unsound({Reason::too_narrow, width, least});
  if (surface.recently_checked()) return true;
  surface.unchecked = 0;
  const std::vector<Workspace::Index> points = indices_of(work, surface);
  if (bends(work, surface, points)) return unsound({Reason::bent});
  const NoiseSheet sheet = noise_sheet_in(work, points, surface.plane(), surface.id());
  if (sheet.has_large_share_of(points.size()))
    return unsound({.reason = Reason::noise_sheet, .surface = sheet.over});
  if (sheet.points.size() * 20 > points.size()) {
    for (const Workspace::Index i : sheet.points) work.release(i);  // detection would find them again
    return !too_small(work, surface) || unsound({.reason = Reason::noise_sheet, .surface = sheet.over});
  }
  std::vector<std::vector<Workspace::Index>> parts = parts_of(work, points, surface.plane());
  if (parts.size() > 1) split(work, surface, std::move(parts));
  return true;
}

/// Drops inliers that lie 1.5 tolerances and more off the plane, which has moved.
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
  for (const VoxelKey key : misfits) work.requeue(work.window.find(key));
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
      work.requeued.push_back(r.after.key);  // seen better, it may be part of a plane now
      continue;
    }
    SurfaceModel* surface = state.surfaces.find(r.before.surface);
    if (surface == nullptr) continue;
    const std::uint64_t unchecked = surface->unchecked;
    const PointWindow::Index i = work.window.find(r.after.key);
    if (std::fabs(surface->distance(r.after.position)) <= state.noise.tolerance(r.after, surface->plane())) {
      work.move(i, r.before.position);
      if (surface->expensive_to_check()) surface->unchecked = unchecked;  // where it was, only better seen
    } else {
      work.requeue(i, r.before.position);
    }
  }
  for (const SurfaceId id : work.changes.touched())
    if (SurfaceModel& surface = *state.surfaces.find(id); too_small(work, surface))
      dissolve(work, surface, Points::requeued);
}

void accumulate_evidence(Workspace& work, const VoxelScan& scan,
                         std::span<const OccupancyDelta::Confirmed> confirmed) {
  constexpr double independent = 8;  // readings in a voxel whose errors are not common to all
  constexpr double least_facing = 0.1;
  constexpr std::size_t large_surface = 2000;  // inliers; every eighth reading is enough for its plane
  const NoiseModel& noise = work.state.noise;
  const Eigen::Vector3d origin = scan.origin.cast<double>();
  SurfaceModel* surface = nullptr;  // they come in runs of one surface
  SurfaceId found = 0;
  for (const OccupancyDelta::Confirmed& c : confirmed) {
    if (c.surface != found) surface = work.state.surfaces.find(found = c.surface);
    if (surface == nullptr || (surface->size() > large_surface && c.end % 8 != 0)) continue;
    const EndVoxel& end = scan.ends[c.end];
    const Eigen::Vector3d sight = origin - end.centroid.cast<double>();
    const double range = sight.norm();
    const double facing = std::max(least_facing, surface->plane().normal.dot(sight) / range);
    const unsigned range_class = range_class_of(static_cast<float>(range));
    if (std::fabs(surface->distance(end.centroid)) > noise.tolerance(range_class, facing)) continue;
    if (!surface->surrounded(surface->cell_of(end.centroid))) continue;
    const double n = independent * end.count / (independent + end.count);
    const double ratio = noise.sigma(1) / (noise.measured_sigma(range_class) * facing);
    surface->observe(end.centroid, n * ratio * ratio);
  }
}

void refit(Workspace& work) {
  MapState& state = work.state;
  const double max_displacement = state.parameters.surface_tolerance() / 4;
  for (const SurfaceId id : work.changes.touched()) {
    SurfaceModel& surface = *state.surfaces.find(id);
    const Plane plane =
        fitted_plane(surface.moments(&state.noise), surface.reference(), surface.plane().normal);
    surface.set_plane(plane);
    if (displacement(surface, plane, surface.checked_plane) > max_displacement) drop_misfits(work, surface);
    surface.rehash_if_tilted();
    if (too_small(work, surface)) {
      work.changes.unsound[id] = fewer_than_n(
          few::on_plane, surface.size(), static_cast<std::size_t>(state.parameters.min_surface_points()));
      dissolve(work, surface, Points::requeued);
    } else if (state.parameters.aligned() && !still_sound(work, surface)) {
      dissolve(work, surface, Points::released);
    }
  }
}

bool coplanar(const SurfaceModel& a, const SurfaceModel& b, const Eigen::Vector3d& contact,
              const NoiseModel& noise) {
  constexpr double cos_10_deg = 0.984807753012208;  // however unsure
  if (a.plane().normal.dot(b.plane().normal) < cos_10_deg) return false;
  const auto patch = [&](const SurfaceModel& s) {
    return Patch{s.moments(&noise), s.reference(), s.readings()};
  };
  return one_plane(patch(a), patch(b), a.plane(), contact, noise.base_tolerance(), a.resolution());
}

bool joint_plane_fits(const SurfaceModel& a, const SurfaceModel& b, const NoiseModel& noise) {
  constexpr double cos_10_deg = 0.984807753012208;
  if (a.plane().normal.dot(b.plane().normal) < cos_10_deg) return false;
  Moments joint = b.moments(&noise).shifted(a.reference() - b.reference());
  joint.add(a.moments(&noise));
  const Plane plane = fitted_plane(joint, a.reference(), a.plane().normal);
  const auto fits = [&](const SurfaceModel& s) {
    const Moments m = s.moments(&noise);
    const auto rms = [&](const Plane& p) {
      return std::sqrt(m.mean_squared_distance(p.normal, p.offset - p.normal.dot(s.reference())));
    };
    return rms(plane) <= rms(s.plane()) + noise.base_tolerance() / 3;
  };
  return fits(a) && fits(b);
}

void merge(Workspace& work, SurfaceModel& into, SurfaceModel& from) {
  MapState& state = work.state;
  const SurfaceId gone = from.id();
  into.take_evidence(from);
  for (const Inlier& inlier : from.sorted_inliers()) work.absorb(work.window.find(inlier.key), into);
  into.parents().push_back(gone);
  state.surfaces.erase(gone, into.id());
  work.changes.merged.insert(gone);
}

/// Surfaces that came and went within the scan are noted, too: one may link a parent to its heirs.
void note_departures(MapState& state, const Snapshot& before) {
  std::vector<Departure> departures = state.surfaces.take_departures();
  const std::size_t surfaces = departures.size();
  for (const Departure& cylinder : state.cylinders.take_departures()) departures.push_back(cylinder);
  if (departures.empty()) return;
  for (std::size_t i = 0; i < departures.size(); ++i) {
    Departure& departure = departures[i];
    departure.revision = state.revision;
    if (!(i < surfaces ? before.find(departure.id) != nullptr
                       : before.find_cylinder(departure.id) != nullptr))
      departure.born = state.revision;
  }
  state.departures = state.departures.with(departures);
}

void derive(Workspace& work) {
  MapState& state = work.state;
  ++state.revision;
  const std::shared_ptr<const Snapshot> before = state.snapshot.load();
  auto next = std::make_shared<Snapshot>(Snapshot{state.revision, before->resolution, {}});
  const std::set<SurfaceId> touched = work.changes.touched();
  for (auto& [id, surface] : state.surfaces) {
    const auto at = std::lower_bound(before->surfaces.begin(), before->surfaces.end(), id,
                                     [](const SurfacePtr& s, SurfaceId wanted) { return s->id < wanted; });
    const bool published = at != before->surfaces.end() && (*at)->id == id;
    if (published && !touched.contains(id)) {
      next->surfaces.push_back(*at);
      continue;
    }
    surface.derive(state.parameters.max_hole_size(), &state.noise);
    surface.derive_covariance(state.noise);
    if (!published) surface.born = state.revision;
    surface.revision = state.revision;
    next->surfaces.push_back(surface.publish(state.revision));
  }
  next->cylinders = state.cylinders.publish(state.revision);
  note_departures(state, *before);
  next->departures = state.departures;
  if (state.octree_shared) next->octree = state.occupancy.share();
  state.snapshot.store(std::move(next));
}

}  // namespace octosurf
