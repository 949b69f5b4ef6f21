#pragma once

#include "surfaces/map_state.hpp"

#include <memory>

namespace octosurf::surfaces {

/// The changes of a map between two snapshots, all or nothing. From construction on the previous state is
/// recorded, at a cost that follows the writes: copies of the octree's chunks and of the surfaces' planes and
/// sums, not of their points. Without commit() the destructor rolls everything back.
///
/// One at a time for a map.
class Transaction {
 public:
  explicit Transaction(MapState& state);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();

  /// Keeps all changes, and publishes `next` to readers; null: the snapshot stays.
  void commit(std::shared_ptr<const Published::State> next) noexcept;

 private:
  /// State saved by copy.
  struct Records {
    explicit Records(const MapState& state);
    void put_back(MapState& state) noexcept;

    sensing::NoiseModel noise;
    RemovalLog removals;
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
