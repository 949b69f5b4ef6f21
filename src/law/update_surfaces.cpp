#include "law/update_surfaces.hpp"

#include "law/neighbourhood.hpp"
#include "law/segment.hpp"
#include "law/waiting.hpp"
#include "law/write_surfaces.hpp"

#include <algorithm>
#include <set>
#include <vector>

namespace octosurf::law {
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
void refit_others(surfaces::Ledger& ledger, const std::set<SurfaceId>& grown) {
  for (const SurfaceId id : ledger.changes.touched()) {
    if (ledger.changes.refitted.contains(id) && !grown.contains(id)) continue;
    surfaces::SurfaceModel& surface = *ledger.find(id);
    surface.set_plane(
        geometry::fitted_plane(surface.moments(&ledger.noise), surface.reference(), surface.plane().normal));
    surface.rehash_if_tilted();
  }
}

/// Pending readings that have a surface now.
std::vector<geometry::VoxelKey> newly_given(const Readings& readings, const Segmentation& found) {
  std::vector<geometry::VoxelKey> given;
  for (Readings::Index i = 0; i < readings.size(); ++i)
    if (readings[i].surface == 0 && found.labels[i] != clutter) given.push_back(readings[i].key);
  return given;
}

/// Segments around `changed` and around the surfaces of `anew`, which begin without a label. The surfaces
/// that have grown beyond that since their planes were fitted.
std::set<SurfaceId> segment_around(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                                   std::span<const geometry::VoxelKey> changed,
                                   std::span<const SurfaceId> anew) {
  const Neighbourhood around = neighbourhood_of(ledger, changed, anew);
  if (around.voxels.empty()) return {};
  const Readings readings(octree, ledger.window, around, ledger.noise);
  const Segmentation found =
      segment(readings, limits_of(ledger.parameters), known_about(readings, ledger.surfaces, anew));
  const std::vector<SurfaceId> ids = write_surfaces(ledger, readings, found, Planes::touched);
  std::vector<bool> whole(ids.size(), true);
  for (const Outside& part : found.outside) whole[part.label] = false;
  for (Label label = 1; label < ids.size(); ++label)
    if (whole[label]) ledger.find(ids[label])->set_checked();
  return grow_from(ledger, newly_given(readings, found));
}

/// What waits, and what has lost its surface and found no other: it is segmented again once enough has
/// come there.
std::vector<geometry::VoxelKey> with_released(surfaces::Ledger& ledger,
                                              std::vector<geometry::VoxelKey> waiting) {
  for (const geometry::VoxelKey key : ledger.changes.requeued)
    if (ledger.window[ledger.window.find(key)].surface == 0) waiting.push_back(key);
  ledger.changes.requeued.clear();
  std::sort(waiting.begin(), waiting.end());
  waiting.erase(std::unique(waiting.begin(), waiting.end()), waiting.end());
  return waiting;
}

}  // namespace

LeftPending update_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap& octree,
                            std::vector<geometry::VoxelKey> waiting,
                            std::span<const geometry::VoxelKey> fresh) {
  ledger.changes.requeued.clear();  // they are among the fresh
  const std::vector<geometry::VoxelKey> unexplained = take_in(ledger, fresh);
  Waiting found = due_to_segment(ledger, std::move(waiting), unexplained);
  std::set<SurfaceId> grown = segment_around(ledger, octree, found.due, {});
  if (const std::vector<SurfaceId> anew = to_be_checked(ledger); !anew.empty())
    grown.merge(segment_around(ledger, octree, {}, anew));
  refit_others(ledger, grown);
  std::erase_if(found.due,
                [&](geometry::VoxelKey key) { return ledger.window[ledger.window.find(key)].surface != 0; });
  return {.waiting = with_released(ledger, std::move(found.left)), .refused = std::move(found.due)};
}

}  // namespace octosurf::law
