#include "upkeep/revise.hpp"

#include "geometry/planarity.hpp"
#include "surfaces/criteria/parts.hpp"
#include "surfaces/criteria/soundness.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace octosurf::upkeep {
namespace {

/// Largest distance between two planes over the surface's own extent.
double displacement(const surfaces::SurfaceModel& surface, const Plane& a, const Plane& b) {
  const geometry::Moments m = surface.moments(nullptr);
  const double reach = 2 * std::sqrt(std::max(0.0, m.covariance().trace()));
  const Eigen::Vector3d centre = surface.reference() + m.mean();
  return std::fabs(a.signed_distance(centre) - b.signed_distance(centre)) +
         reach * (a.normal - b.normal).norm();
}

std::vector<surfaces::MapView::Index> indices_of(surfaces::Ledger& ledger,
                                                 const surfaces::SurfaceModel& surface) {
  std::vector<surfaces::MapView::Index> indices;
  indices.reserve(surface.size());
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    indices.push_back(ledger.window.find(inlier.key));
  return indices;
}

bool bends(const surfaces::Ledger& ledger, const surfaces::SurfaceModel& surface,
           std::span<const surfaces::MapView::Index> points) {
  geometry::Planarity planarity(surface.pose());
  for (const surfaces::MapView::Index i : points) {
    const occupancy::VoxelPoint& p = ledger.window[i];
    planarity.add(p.position, ledger.noise.sigma(p.range_class), ledger.noise.tolerance(p.range_class),
                  surface.surrounded(surface.cell_of(p.position)));
  }
  // Its scatter is not checked: a voxel that noise reached once counts as much as one hit by every scan.
  return planarity.bends();
}

/// The largest part keeps the id, and the parts that are too small for a surface of their own.
void split(surfaces::Ledger& ledger, surfaces::SurfaceModel& surface,
           std::vector<std::vector<surfaces::MapView::Index>> parts) {
  const auto largest = std::max_element(parts.begin(), parts.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const auto min_points = static_cast<std::size_t>(ledger.parameters.min_surface_points());
  surface.forget_evidence();  // it mixes readings of all parts
  for (auto part = parts.begin(); part != parts.end(); ++part) {
    if (part == largest || part->size() < min_points) continue;
    surfaces::SurfaceModel& own = ledger.create(surfaces::fitted(ledger, *part, surface.plane()),
                                                ledger.window[part->front()].position.cast<double>());
    own.parents().push_back(surface.id());
    for (const surfaces::MapView::Index i : *part) ledger.reassign(i, own);
    ledger.changes.born.insert(own.id());
  }
  // The plane it was refitted to lay between the parts.
  surface.set_plane(
      geometry::fitted_plane(surface.moments(&ledger.noise), surface.reference(), surface.plane().normal));
  surface.rehash_if_tilted();
}

/// Checks a surface that has changed by a quarter for being one plane, and splits it if it is several. A
/// surface may turn out to be none when closer views have less noise: if a few far points made it, if it has
/// grown around a pillar or over two blocks, or if it is the noise of one found later. False if it is none.
bool still_sound(surfaces::Ledger& ledger, surfaces::SurfaceModel& surface) {
  // Neighbours may have taken points from it. A known surface may be a fifth narrower than a new one.
  const double width = geometry::width_of(surface.moments(nullptr));
  const double min_width = 0.8 * ledger.parameters.surfaces.min_surface_width;
  const auto unsound = [&](const surfaces::Refusal& why) {
    ledger.changes.unsound[surface.id()] = why;
    return false;
  };
  if (width < min_width) return unsound({Reason::too_narrow, width, min_width});
  if (surface.recently_checked()) return true;
  surface.unchecked = 0;
  const std::vector<surfaces::MapView::Index> points = indices_of(ledger, surface);
  if (const std::optional<surfaces::Refusal> narrow =
          surfaces::narrow_strips(ledger, points, surface.plane(), min_width))
    return unsound(*narrow);
  if (bends(ledger, surface, points)) return unsound({Reason::bent});
  const surfaces::NoiseSheet sheet = surfaces::noise_sheet_in(ledger, points, surface.plane(), surface.id());
  if (sheet.has_large_share_of(points.size()))
    return unsound({.reason = Reason::noise_sheet, .surface = sheet.over});
  if (sheet.points.size() * 20 > points.size()) {
    for (const surfaces::MapView::Index i : sheet.points)
      ledger.release(i);  // detection would find them again
    return !ledger.too_small(surface) || unsound({.reason = Reason::noise_sheet, .surface = sheet.over});
  }
  std::vector<std::vector<surfaces::MapView::Index>> parts =
      surfaces::parts_of(ledger, points, surface.plane());
  if (parts.size() > 1) split(ledger, surface, std::move(parts));
  return true;
}

/// Drops inliers that lie 1.5 tolerances and more off the plane, which has moved.
void drop_misfits(surfaces::Ledger& ledger, surfaces::SurfaceModel& surface) {
  const sensing::NoiseModel& noise = ledger.noise;
  std::vector<geometry::VoxelKey> misfits;
  surface.for_each_inlier([&](const surfaces::Inlier& inlier) {
    const double distance = std::fabs(surface.distance(inlier.position));
    if (distance <= 1.5 * noise.base_tolerance()) return;  // nearly all
    const occupancy::VoxelPoint& p = ledger.window[ledger.window.find(inlier.key)];
    if (distance > 1.5 * noise.tolerance(p, surface.plane())) misfits.push_back(inlier.key);
  });
  std::sort(misfits.begin(), misfits.end());
  for (const geometry::VoxelKey key : misfits) ledger.requeue(ledger.window.find(key));
  surface.checked_plane = surface.plane();
}

}  // namespace

void refit(surfaces::Ledger& ledger) {
  const double max_displacement = ledger.parameters.surface_tolerance() / 4;
  for (const SurfaceId id : ledger.changes.touched()) {
    surfaces::SurfaceModel& surface = *ledger.find(id);
    const Plane plane =
        geometry::fitted_plane(surface.moments(&ledger.noise), surface.reference(), surface.plane().normal);
    surface.set_plane(plane);
    if (displacement(surface, plane, surface.checked_plane) > max_displacement) drop_misfits(ledger, surface);
    surface.rehash_if_tilted();
    if (ledger.too_small(surface)) {
      ledger.changes.unsound[id] =
          surfaces::fewer_than_n(surfaces::few::on_plane, surface.size(),
                                 static_cast<std::size_t>(ledger.parameters.min_surface_points()));
      ledger.dissolve(surface, surfaces::Points::requeued);
    } else if (ledger.parameters.aligned() && !still_sound(ledger, surface)) {
      ledger.dissolve(surface, surfaces::Points::released);
    }
  }
}

}  // namespace octosurf::upkeep
