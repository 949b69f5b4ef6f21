#pragma once

#include "occupancy/pool.hpp"
#include "occupancy/voxel_payload.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>

namespace octosurf::occupancy {

/// Runs of 1 to 64 payloads, each in a block of the next power of two.
class PayloadStore {
 public:
  const VoxelPayload* at(PayloadRun run) const {
    const VoxelPayload* payloads = nullptr;
    with_pool(*this, run.size_class, [&](const auto& pool) { payloads = pool[run.index].data(); });
    return payloads;
  }
  VoxelPayload* writable(PayloadRun run) {
    VoxelPayload* payloads = nullptr;
    with_pool(*this, run.size_class, [&](auto& pool) { payloads = pool.writable(run.index).data(); });
    return payloads;
  }

  /// Inserts a place at `rank` among `count`; moves the run if it must grow.
  VoxelPayload& insert(PayloadRun& run, unsigned rank, unsigned count) {
    if (count == room(run.size_class)) move(run, run.size_class + 1U, count);
    VoxelPayload* p = writable(run);
    std::copy_backward(p + rank, p + count, p + count + 1);
    p[rank] = {};
    return p[rank];
  }
  void erase(PayloadRun& run, unsigned rank, unsigned count) {
    VoxelPayload* p = writable(run);
    std::copy(p + rank + 1, p + count, p + rank);
    --count;
    // Half a class of slack, so that a voxel that alternates does not move the run each time.
    if (count == 0)
      release(run);
    else if (run.size_class > 1 && count * 4 <= room(run.size_class))
      move(run, run.size_class - 1U, count);
  }
  void release(PayloadRun& run) {
    with_pool(*this, run.size_class, [&](auto& pool) { pool.release(run.index); });
    run = {};
  }
  /// Read-only copy, see Pool::share().
  PayloadStore share() {
    PayloadStore copy;
    copy.pools_ = std::apply([](auto&... pool) { return Pools(pool.share()...); }, pools_);
    return copy;
  }
  // See Pool.
  void begin_changes() {
    std::apply([](auto&... pool) { (pool.begin_changes(), ...); }, pools_);
  }
  void commit() noexcept {
    std::apply([](auto&... pool) { (pool.commit(), ...); }, pools_);
  }
  void roll_back() noexcept {
    std::apply([](auto&... pool) { (pool.roll_back(), ...); }, pools_);
  }
  std::size_t bytes() const {
    return std::apply([](const auto&... pool) { return (pool.bytes() + ...); }, pools_);
  }

 private:
  /// The pool of a size class; none of class 0.
  template <class Self, class Visit>
  static void with_pool(Self& self, unsigned size_class, const Visit& visit) {
    std::apply(
        [&](auto&... pool) {
          unsigned of = 0;
          ((++of == size_class ? visit(pool) : void()), ...);
        },
        self.pools_);
  }
  static unsigned room(unsigned size_class) { return size_class == 0 ? 0 : 2U << size_class; }
  PayloadRun make(unsigned size_class) {
    PayloadRun run{0, static_cast<std::uint8_t>(size_class)};
    with_pool(*this, size_class, [&](auto& pool) { run.index = pool.make(); });
    return run;
  }
  void move(PayloadRun& run, unsigned size_class, unsigned count) {
    const PayloadRun to = make(size_class);
    if (count > 0) std::copy_n(at(run), count, writable(to));
    release(run);
    run = to;
  }

  template <std::size_t payloads, unsigned chunk_bits>
  using PoolOf = Pool<std::array<VoxelPayload, payloads>, chunk_bits>;
  using Pools = std::tuple<PoolOf<4, 9>, PoolOf<8, 8>, PoolOf<16, 7>, PoolOf<32, 6>, PoolOf<64, 5>>;
  Pools pools_;  ///< by size class, from 1 on
};

}  // namespace octosurf::occupancy
