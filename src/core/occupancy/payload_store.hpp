#pragma once

#include "occupancy/pool.hpp"
#include "occupancy/voxel_payload.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

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
    copy.fours_ = fours_.share();
    copy.eights_ = eights_.share();
    copy.sixteens_ = sixteens_.share();
    copy.thirty_twos_ = thirty_twos_.share();
    copy.sixty_fours_ = sixty_fours_.share();
    return copy;
  }
  // See Pool.
  void begin_changes() {
    for_each_pool([](auto& pool) { pool.begin_changes(); });
  }
  void commit() noexcept {
    for_each_pool([](auto& pool) { pool.commit(); });
  }
  void roll_back() noexcept {
    for_each_pool([](auto& pool) { pool.roll_back(); });
  }
  std::size_t bytes() const {
    return fours_.bytes() + eights_.bytes() + sixteens_.bytes() + thirty_twos_.bytes() + sixty_fours_.bytes();
  }

 private:
  /// The pool of a size class; none of class 0.
  template <class Self, class Visit>
  static void with_pool(Self& self, unsigned size_class, const Visit& visit) {
    switch (size_class) {
      case 1:
        return visit(self.fours_);
      case 2:
        return visit(self.eights_);
      case 3:
        return visit(self.sixteens_);
      case 4:
        return visit(self.thirty_twos_);
      case 5:
        return visit(self.sixty_fours_);
      default:
        return;
    }
  }
  template <class Visit>
  void for_each_pool(const Visit& visit) {
    for (unsigned size_class = 1; size_class <= 5; ++size_class) with_pool(*this, size_class, visit);
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

  Pool<std::array<VoxelPayload, 4>, 9> fours_;
  Pool<std::array<VoxelPayload, 8>, 8> eights_;
  Pool<std::array<VoxelPayload, 16>, 7> sixteens_;
  Pool<std::array<VoxelPayload, 32>, 6> thirty_twos_;
  Pool<std::array<VoxelPayload, 64>, 5> sixty_fours_;
};

}  // namespace octosurf::occupancy
