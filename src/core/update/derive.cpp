#include "update/derive.hpp"

#include "geometry/parallel.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace octosurf::update {
namespace {

/// Surfaces created and removed within the scan are recorded, too: one may link a parent to its successors.
void note_removals(surfaces::MapState& state, const Snapshot& before) {
  std::vector<Removal> removals = state.surfaces.take_removals();
  const std::size_t surfaces = removals.size();
  for (const Removal& cylinder : state.cylinders.take_removals()) removals.push_back(cylinder);
  if (removals.empty()) return;
  for (std::size_t i = 0; i < removals.size(); ++i) {
    Removal& removal = removals[i];
    removal.revision = state.revision;
    if (!(i < surfaces ? before.find(removal.id) != nullptr : before.find_cylinder(removal.id) != nullptr))
      removal.born = state.revision;
  }
  state.removals = state.removals.with(removals);
}

/// Inserts or replaces, in order of id.
void put(std::vector<SurfacePtr>& surfaces, SurfacePtr surface) {
  const auto at = std::lower_bound(surfaces.begin(), surfaces.end(), surface->id,
                                   [](const SurfacePtr& s, SurfaceId wanted) { return s->id < wanted; });
  if (at != surfaces.end() && (*at)->id == surface->id)
    *at = std::move(surface);
  else
    surfaces.insert(at, std::move(surface));
}

struct Derived {
  std::vector<SurfacePtr> surfaces;
  std::vector<surfaces::OutlineChange> changes;  // none if `surfaces` have their polygons
};

/// Each surface by one thread, the largest first to balance the load.
Derived derived(const surfaces::MapState& state, std::vector<surfaces::SurfaceModel*> models,
                const Snapshot& before, bool inliers_alone, int threads) {
  std::stable_sort(models.begin(), models.end(),
                   [](const auto* a, const auto* b) { return a->size() > b->size(); });
  const double h = state.parameters.max_hole_size();
  for (surfaces::SurfaceModel* model : models)
    model->update_raster(h, inliers_alone ? nullptr : &state.noise);
  Derived all{std::vector<SurfacePtr>(models.size()), std::vector<surfaces::OutlineChange>(models.size())};
  geometry::share_among(threads, models.size(), [&](std::size_t i) {
    surfaces::SurfaceModel& model = *models[i];
    if (inliers_alone)
      model.derive(h);  // its outlines decide about inliers
    else
      all.changes[i] = model.take_outline_change(h, &state.surfaces);
    model.derive_covariance(state.noise);
    if (before.find(model.id()) == nullptr) model.born = state.revision;
    model.revision = state.revision;
    all.surfaces[i] = model.publish(state.revision);
  });
  if (inliers_alone) all.changes.clear();
  return all;
}

}  // namespace

std::shared_ptr<const surfaces::Published::State> derive(surfaces::MapState& state,
                                                         const surfaces::Changes& changes, bool inliers_alone,
                                                         int threads) {
  ++state.revision;
  const std::shared_ptr<const Snapshot> before = state.snapshot.latest();
  auto next = std::make_shared<Snapshot>(Snapshot{state.revision, before->resolution, {}});
  next->surfaces.reserve(before->surfaces.size() + changes.born.size());
  next->surfaces = before->surfaces;
  if (!changes.gone.empty() || !changes.merged.empty())
    std::erase_if(next->surfaces, [&](const SurfacePtr& surface) {
      return changes.gone.contains(surface->id) || changes.merged.contains(surface->id);
    });
  std::vector<surfaces::SurfaceModel*> touched;
  for (const SurfaceId id : changes.touched()) touched.push_back(state.surfaces.find(id));
  Derived now = derived(state, std::move(touched), *before, inliers_alone, threads);
  for (SurfacePtr& surface : now.surfaces) put(next->surfaces, std::move(surface));
  next->cylinders = state.cylinders.publish(state.revision);
  note_removals(state, *before);
  next->removals = state.removals;
  if (state.octree_shared) next->octree = state.occupancy.share();
  return state.snapshot.next(std::move(next), std::move(now.changes));
}

}  // namespace octosurf::update
