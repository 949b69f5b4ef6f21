#pragma once

#include "surfaces/atomic_shared_ptr.hpp"
#include "surfaces/outline_change.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {

/// The state that readers in other threads see. Its outlines are made when one of them reads it, by that
/// thread: those of surfaces that changed since the last read, each once, however often it changed.
class Published {
  struct Batch {
    std::uint64_t number;
    std::vector<OutlineChange> changes;
  };
  using Batches = std::vector<std::shared_ptr<const Batch>>;  // in order of their numbers

 public:
  /// A snapshot with changes of outlines that it may lack.
  struct State {
    std::shared_ptr<const Snapshot> snapshot;
    Batches batches;
  };

  explicit Published(std::shared_ptr<const Snapshot> snapshot)
      : state_(std::make_shared<State>(State{snapshot, {}})), readers_(std::make_shared<Readers>(snapshot)) {}

  /// Of the last store(), complete. From any thread; never waits for the mapper, but for another reader while
  /// that makes the outlines both need. Some 3 µs for each place on an outline that changed since the last
  /// read. Throws what allocations throw; the next call tries again.
  std::shared_ptr<const Snapshot> read() const;

  // In the mapper's thread:

  /// What reads the state of now, later and in any thread, whatever is stored and read meanwhile: whoever
  /// reads a later state makes this one's outlines first. One at a time.
  std::function<std::shared_ptr<const Snapshot>()> keep() const;
  /// The same, without polygons, boundary and area of surfaces whose outlines were left to the reader. O(1).
  std::shared_ptr<const Snapshot> latest() const { return state_.load()->snapshot; }
  /// A state that store() may publish: with `changes` of the outlines of surfaces in the snapshot, those that
  /// a reader has not applied yet included. Amortised O(changes); memory is bounded by the outlines' own
  /// sizes.
  std::shared_ptr<const State> next(std::shared_ptr<const Snapshot> snapshot,
                                    std::vector<OutlineChange> changes) const;
  void store(std::shared_ptr<const State> state) noexcept { state_.store(std::move(state)); }
  /// A snapshot of which all that is left to the reader was stored before.
  void store(std::shared_ptr<const Snapshot> snapshot) { store(next(std::move(snapshot), {})); }

 private:
  struct Complete {
    std::shared_ptr<const Snapshot> of, snapshot;
  };
  struct Kept {
    std::shared_ptr<const State> state;
    std::shared_ptr<const Snapshot> snapshot;  // of it, complete; null until somebody reads on
  };
  /// What readers share. They wait for each other only.
  struct Readers {
    explicit Readers(const std::shared_ptr<const Snapshot>& snapshot)
        : complete(std::make_shared<Complete>(Complete{snapshot, snapshot})) {}
    std::shared_ptr<const Snapshot> read(const State& state);  // under `making`
    void read(Kept& kept);                                     // likewise

    AtomicSharedPtr<const Complete> complete;  // stored under `making`
    AtomicSharedPtr<Kept> kept{nullptr};
    std::mutex making;
    std::atomic<std::uint64_t> applied{0};  // number of the last batch in the outlines
  };
  static std::map<SurfaceId, OutlineChange> folded(const Batches& batches, std::uint64_t after,
                                                   const Snapshot& snapshot);

  AtomicSharedPtr<const State> state_;
  std::shared_ptr<Readers> readers_;
};

}  // namespace octosurf::surfaces
