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
  const std::uint64_t applied = readers_->applied.load();
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

std::shared_ptr<const Snapshot> Published::Readers::read(const State& state) {
  const std::shared_ptr<const Complete> before = complete.load();
  if (before->of == state.snapshot) return before->snapshot;
  auto next = std::make_shared<Snapshot>(*state.snapshot);
  std::map<SurfaceId, OutlineChange> changes = folded(state.batches, applied, *next);
  std::size_t i = 0;
  for (SurfacePtr& surface : next->surfaces) {
    while (i < before->of->surfaces.size() && before->of->surfaces[i]->id < surface->id) ++i;
    if (i < before->of->surfaces.size() && before->of->surfaces[i] == surface) {
      surface = before->snapshot->surfaces[i];
    } else if (const auto change = changes.find(surface->id); change != changes.end()) {
      auto whole = std::make_shared<Surface>(*surface);
      geometry::set_polygons(*whole, polygons_with(change->second));
      surface = std::move(whole);
    }
  }
  auto done = std::make_shared<Complete>(Complete{state.snapshot, std::move(next)});
  if (!state.batches.empty()) applied = state.batches.back()->number;
  complete.store(done);
  return done->snapshot;
}

void Published::Readers::read(Kept& one) {
  if (!one.snapshot) one.snapshot = read(*one.state);
}

std::shared_ptr<const Snapshot> Published::read() const {
  if (const auto done = readers_->complete.load(); done->of == state_.load()->snapshot) return done->snapshot;
  const std::lock_guard lock(readers_->making);
  if (const std::shared_ptr<Kept> kept = readers_->kept.load()) readers_->read(*kept);
  return readers_->read(*state_.load());
}

std::function<std::shared_ptr<const Snapshot>()> Published::keep() const {
  const auto kept = std::make_shared<Kept>(Kept{state_.load(), nullptr});
  readers_->kept.store(kept);
  return [readers = readers_, kept] {
    const std::lock_guard lock(readers->making);
    readers->read(*kept);
    return kept->snapshot;
  };
}

}  // namespace octosurf::surfaces
