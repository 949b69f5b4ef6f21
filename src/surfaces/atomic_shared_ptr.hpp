#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <thread>

namespace octosurf::surfaces {

/// A shared pointer that one thread replaces while others read it. Readers take no lock: libstdc++'s
/// std::atomic_load(shared_ptr) takes a mutex of a pool, and its std::atomic<shared_ptr> a spin lock, so that
/// a reader that is descheduled in the middle would hold up all others.
///
/// The value lies in one of a few slots. A reader announces itself at the current slot and looks again
/// whether it still is the current one; the writer writes only into slots that are not current and where
/// nobody is announced. All accesses to the atomics are sequentially consistent, on which this rests.
template <class T>
class AtomicSharedPtr {
 public:
  explicit AtomicSharedPtr(std::shared_ptr<T> value) { slots_[0].value = std::move(value); }

  /// From any thread. Tries again only if a store() came between two lines of it.
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

  /// From one thread at a time. Lets go of the values before, but for those that are being read just now.
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
    for (;; std::this_thread::yield())  // only while there is a reader in the middle of load() in every other
      for (unsigned i = 0; i < slots_.size(); ++i)
        if (i != current_.load() && slots_[i].readers.load() == 0) return i;
  }

  mutable std::array<Slot, 8> slots_;
  std::atomic<unsigned> current_{0};
};

}  // namespace octosurf::surfaces
