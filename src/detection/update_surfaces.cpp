#include "detection/update_surfaces.hpp"

#include "detection/expand.hpp"
#include "detection/neighbourhood.hpp"
#include "detection/segment.hpp"
#include "detection/write_surfaces.hpp"

namespace octosurf::detection {
namespace {

/// Those that this scan touched and that have doubled since they were looked at as wholes, so that each of
/// their points is looked at again once on the mean.
std::vector<SurfaceId> to_be_checked(surfaces::Ledger& ledger) {
  std::vector<SurfaceId> ids;
  for (const SurfaceId id : ledger.changes.touched())
    if (ledger.find(id)->size_has_changed()) ids.push_back(id);
  return ids;
}

/// Planes of surfaces that have grown since theirs was fitted, and of those that lost points or saw them
/// better and whose neighbourhood is what it was.
void refit(surfaces::Ledger& ledger, const std::set<SurfaceId>& grown) {
  for (const SurfaceId id : ledger.changes.touched()) {
    if (ledger.changes.refitted.contains(id) && !grown.contains(id)) continue;
    surfaces::SurfaceModel& surface = *ledger.find(id);
    surface.set_plane(
        geometry::fitted_plane(surface.moments(&ledger.noise), surface.reference(), surface.plane().normal));
    surface.rehash_if_tilted();
  }
}

/// What became of the pending readings.
Detected detected(const Readings& readings, const Segmentation& found) {
  Detected result;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (readings[i].surface == 0 && found.labels[i] != clutter) result.assigned.push_back(readings[i].key);
  for (const Readings::Index i : found.too_few)
    if (readings[i].surface == 0 && found.labels[i] == clutter) result.too_few.push_back(readings[i].key);
  return result;
}

/// `anew`: surfaces whose inliers begin without a label.
Detected segment_in(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                    const Neighbourhood& around, std::span<const SurfaceId> anew) {
  if (around.voxels.empty()) return {};
  const Readings readings(octree, ledger.window, around, ledger.noise);
  const Segmentation found =
      segment(readings, limits_of(ledger.parameters), known_about(readings, ledger.surfaces, anew));
  const std::vector<SurfaceId> ids = write_surfaces(ledger, readings, found, Planes::touched);
  std::vector<bool> whole(ids.size(), true);
  for (const Outside& part : found.outside) whole[part.label] = false;
  for (Label label = 1; label < ids.size(); ++label)
    if (whole[label]) ledger.find(ids[label])->set_checked();
  return detected(readings, found);
}

}  // namespace

Detected detect(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                std::span<const geometry::VoxelKey> due, std::span<const geometry::VoxelKey> touching) {
  return segment_in(ledger, octree, neighbourhood_of(ledger, due, touching), {});
}

void revise(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree, std::set<SurfaceId> grown) {
  if (const std::vector<SurfaceId> anew = to_be_checked(ledger); !anew.empty()) {
    const Detected found = segment_in(ledger, octree, neighbourhood_of(ledger, anew), anew);
    const std::vector<Assignment> more = expand(ledger, pending_beside(ledger, found.assigned));
    assign(ledger, more);
    for (const Assignment& assignment : more) grown.insert(assignment.surface);
  }
  refit(ledger, grown);
}

}  // namespace octosurf::detection
