// operator new that counts, for test_fuzz. What C libraries allocate (zstd's window, at most 8 MiB; libspng's
// inflate, 64 kB) goes by uncounted.
#include "fuzz/targets.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <malloc.h>
#include <new>

namespace {
std::atomic<std::size_t> in_use{0}, most{0};
}

void* operator new(std::size_t bytes) {
  void* place = std::malloc(bytes == 0 ? 1 : bytes);
  if (place == nullptr) throw std::bad_alloc();
  const std::size_t now = in_use += malloc_usable_size(place);
  for (std::size_t seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
  }
  return place;
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept try {
  return operator new(bytes);
} catch (const std::bad_alloc&) {
  return nullptr;
}
void operator delete(void* place) noexcept {
  if (place != nullptr) in_use -= malloc_usable_size(place);
  std::free(place);
}
void operator delete(void* place, std::size_t) noexcept { operator delete(place); }
void operator delete(void* place, const std::nothrow_t&) noexcept { operator delete(place); }

namespace octosurf::fuzz {

std::size_t reading_peak = 0;

PeakMemory::PeakMemory(std::size_t& peak) : peak_(peak), before_(in_use) { most = before_; }
PeakMemory::~PeakMemory() { peak_ = std::max(peak_, most - before_); }

}  // namespace octosurf::fuzz
