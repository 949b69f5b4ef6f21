#pragma once

#include "surfaces/map_state.hpp"

#include <memory>

namespace octosurf::surfaces {

/// What scans do to a map between two snapshots: all of it, or nothing. From the constructor on what the map
/// was is kept, at a cost that follows what is written to: a copy of the octree's chunks and of the surfaces'
/// planes and sums, not of their points. Whatever is thrown, the destructor takes everything back.
///
/// One at a time for a map.
class Transaction {
 public:
  explicit Transaction(MapState& state);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();

  /// Everything stays, and `next` is what readers see from now on; null: what they see stays.
  void commit(std::shared_ptr<const Snapshot> next) noexcept;

 private:
  /// What is small enough to be copied.
  struct Records {
    explicit Records(const MapState& state);
    void put_back(MapState& state) noexcept;

    sensing::NoiseModel noise;
    AlignmentState alignment;
    DepartureLog departures;
    PendingQueue queue;
    std::size_t points, held;
    std::uint64_t scans, revision;
    Eigen::Vector3d sensors_up;
  };

  MapState& state_;
  Records before_;
  bool open_ = true;
};

}  // namespace octosurf::surfaces
