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
  explicit PayloadStore(memory::PageFile* file = nullptr)
      : fours_(file), eights_(file), sixteens_(file), thirty_twos_(file), sixty_fours_(file) {}

  const VoxelPayload* at(PayloadRun run) const {
    switch (run.size_class) {
      case 1:
        return fours_[run.index].data();
      case 2:
        return eights_[run.index].data();
      case 3:
        return sixteens_[run.index].data();
      case 4:
        return thirty_twos_[run.index].data();
      case 5:
        return sixty_fours_[run.index].data();
      default:
        return nullptr;
    }
  }
  VoxelPayload* writable(PayloadRun run) {
    switch (run.size_class) {
      case 1:
        return fours_.writable(run.index).data();
      case 2:
        return eights_.writable(run.index).data();
      case 3:
        return sixteens_.writable(run.index).data();
      case 4:
        return thirty_twos_.writable(run.index).data();
      case 5:
        return sixty_fours_.writable(run.index).data();
      default:
        return nullptr;
    }
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
    switch (run.size_class) {
      case 1:
        fours_.release(run.index);
        break;
      case 2:
        eights_.release(run.index);
        break;
      case 3:
        sixteens_.release(run.index);
        break;
      case 4:
        thirty_twos_.release(run.index);
        break;
      case 5:
        sixty_fours_.release(run.index);
        break;
      default:
        break;
    }
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
  template <class Visit>
  void for_each_pool(const Visit& visit) {
    visit(fours_);
    visit(eights_);
    visit(sixteens_);
    visit(thirty_twos_);
    visit(sixty_fours_);
  }
  static unsigned room(unsigned size_class) { return size_class == 0 ? 0 : 2U << size_class; }
  PayloadRun make(unsigned size_class) {
    const auto c = static_cast<std::uint8_t>(size_class);
    switch (size_class) {
      case 1:
        return {fours_.make(), c};
      case 2:
        return {eights_.make(), c};
      case 3:
        return {sixteens_.make(), c};
      case 4:
        return {thirty_twos_.make(), c};
      default:
        return {sixty_fours_.make(), c};
    }
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
