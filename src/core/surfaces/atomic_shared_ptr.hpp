#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <thread>

namespace octosurf::surfaces {

/// A shared pointer that one thread replaces while others read it. Readers take no lock: libstdc++'s
/// std::atomic_load(shared_ptr) locks a mutex of a pool, and its std::atomic<shared_ptr> a spin lock, so a
/// descheduled reader would block all others.
///
/// The value is in one of a few slots. A reader registers at the current slot and checks that it is still
/// current; the writer writes only to slots that are not current and have no registered reader. This requires
/// sequentially consistent accesses to all atomics.
template <class T>
class AtomicSharedPtr {
 public:
  explicit AtomicSharedPtr(std::shared_ptr<T> value) { slots_[0].value = std::move(value); }

  /// From any thread. Retries only if a store() happened between two lines of it.
  std::shared_ptr<T> load() const {
    for (;;) {
      const unsigned i = current_.load();
      Slot& slot = slots_[i];
      slot.readers.fetch_add(1);
      std::shared_ptr<T> value;
      const bool still_current = current_.load() == i;
      if (still_current) value = slot.value;
      slot.readers.fetch_sub(1);
      if (still_current) return value;
    }
  }

  /// From one thread at a time. Releases previous values, except those being read.
  void store(std::shared_ptr<T> value) {
    const unsigned next = unused_slot();
    slots_[next].value = std::move(value);
    current_.store(next);
    for (unsigned i = 0; i < slots_.size(); ++i)
      if (i != next && slots_[i].readers.load() == 0) slots_[i].value.reset();
  }

 private:
  struct alignas(64) Slot {  // a cache line each
    std::atomic<int> readers{0};
    std::shared_ptr<T> value;
  };
  unsigned unused_slot() const {
    for (;; std::this_thread::yield())  // only while load() is in progress in every other slot
      for (unsigned i = 0; i < slots_.size(); ++i)
        if (i != current_.load() && slots_[i].readers.load() == 0) return i;
  }

  mutable std::array<Slot, 8> slots_;
  std::atomic<unsigned> current_{0};
};

}  // namespace octosurf::surfaces
