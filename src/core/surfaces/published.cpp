#include "surfaces/published.hpp"

#include "geometry/rings.hpp"

#include <utility>

namespace octosurf::surfaces {
std::map<SurfaceId, OutlineChange> Published::folded(const Batches& batches, std::uint64_t after,
                                                     const Snapshot& snapshot) {
  std::map<SurfaceId, std::vector<const OutlineChange*>> of_surface;
  for (auto batch = batches.rbegin(); batch != batches.rend() && (*batch)->number > after; ++batch)
    for (const OutlineChange& change : (*batch)->changes) of_surface[change.id].push_back(&change);
  std::map<SurfaceId, OutlineChange> changes;
  for (const auto& [id, newest_first] : of_surface)
    if (snapshot.find(id) != nullptr) changes.emplace(id, surfaces::folded(newest_first));
  return changes;
}

std::shared_ptr<const Published::State> Published::next(std::shared_ptr<const Snapshot> snapshot,
                                                        std::vector<OutlineChange> changes) const {
  constexpr std::size_t most_batches = 16;  // then one is made of them: a sixteenth of its cost a scan
  const std::uint64_t applied = applied_.load();
  const Batches& before = state_.load()->batches;
  auto next = std::make_shared<State>(State{std::move(snapshot), {}});
  for (const auto& batch : before)
    if (batch->number > applied) next->batches.push_back(batch);
  if (!changes.empty())
    next->batches.push_back(std::make_shared<Batch>(
        Batch{(before.empty() ? applied : before.back()->number) + 1, std::move(changes)}));
  if (next->batches.size() <= most_batches) return next;
  auto all = std::make_shared<Batch>(Batch{next->batches.back()->number, {}});
  for (auto& [id, change] : folded(next->batches, applied, *next->snapshot))
    all->changes.push_back(std::move(change));
  next->batches = {std::move(all)};
  return next;
}

std::shared_ptr<const Snapshot> Published::complete(const State& state, const Complete& before) const {
  auto next = std::make_shared<Snapshot>(*state.snapshot);
  std::map<SurfaceId, OutlineChange> changes = folded(state.batches, applied_, *next);
  std::size_t i = 0;
  for (SurfacePtr& surface : next->surfaces) {
    while (i < before.of->surfaces.size() && before.of->surfaces[i]->id < surface->id) ++i;
    if (i < before.of->surfaces.size() && before.of->surfaces[i] == surface) {
      surface = before.snapshot->surfaces[i];
    } else if (const auto change = changes.find(surface->id); change != changes.end()) {
      auto whole = std::make_shared<Surface>(*surface);
      geometry::set_polygons(*whole, polygons_with(change->second));
      surface = std::move(whole);
    }
  }
  return next;
}

std::shared_ptr<const Snapshot> Published::read() const {
  if (const auto done = complete_.load(); done->of == state_.load()->snapshot) return done->snapshot;
  const std::lock_guard lock(making_);
  const std::shared_ptr<const Complete> before = complete_.load();
  const std::shared_ptr<const State> state = state_.load();
  if (before->of == state->snapshot) return before->snapshot;
  auto done = std::make_shared<Complete>(Complete{state->snapshot, complete(*state, *before)});
  if (!state->batches.empty()) applied_ = state->batches.back()->number;
  complete_.store(done);
  return done->snapshot;
}

}  // namespace octosurf::surfaces
