#include "surfaces/transaction.hpp"

#include <type_traits>
#include <utility>

namespace octosurf::surfaces {

Transaction::Records::Records(const MapState& state)
    : noise(state.noise),
      removals(state.removals),
      queue(state.queue),
      points(state.points),
      held(state.held.size()),
      scans(state.scans),
      revision(state.revision),
      sensors_up(state.sensors_up) {}

// A std::deque among the members would take memory to be moved.
static_assert(std::is_nothrow_swappable_v<RemovalLog> &&
              std::is_nothrow_copy_assignable_v<sensing::NoiseModel>);

void Transaction::Records::put_back(MapState& state) noexcept {
  state.noise = noise;
  std::swap(state.removals, removals);
  std::swap(state.queue, queue);
  state.points = points;
  state.held.resize(held);  // shrinks
  state.scans = scans;
  state.revision = revision;
  state.sensors_up = sensors_up;
}

Transaction::Transaction(MapState& state) : state_(state), before_(state) {
  state.cylinders.begin_changes();  // the only one that allocates
  state.surfaces.begin_changes();
  state.occupancy.begin_changes();
}

void Transaction::commit(std::shared_ptr<const Published::State> next) noexcept {
  if (next) state_.snapshot.store(std::move(next));
  state_.occupancy.commit();
  state_.surfaces.commit();
  state_.cylinders.commit();
  open_ = false;
}

Transaction::~Transaction() {
  if (!open_) return;
  state_.occupancy.roll_back();
  before_.put_back(state_);
  state_.unrestored = true;
  try {
    state_.restore();
  } catch (...) {  // no memory: the next change of the map tries again
  }
}

}  // namespace octosurf::surfaces
