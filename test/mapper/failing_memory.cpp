#include "mapper/failing_memory.hpp"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

namespace octosurf::test {
namespace {

constexpr std::size_t never = std::numeric_limits<std::size_t>::max();

std::atomic<std::size_t> asked{0}, first_to_fail{never}, failed{0};
std::atomic<bool> all_after_fail{false};

bool fails() {
  const std::size_t now = asked++;
  const std::size_t first = first_to_fail;
  if (now < first || (now > first && !all_after_fail)) return false;
  ++failed;
  return true;
}

}  // namespace

std::size_t allocations() { return asked; }

void fail_allocation_after(std::size_t n, bool all_after) {
  failed = 0;
  all_after_fail = all_after;
  first_to_fail = asked + n;
}

std::size_t stop_failing() {
  first_to_fail = never;
  return failed;
}

}  // namespace octosurf::test

// The forms for arrays call these.

void* operator new(std::size_t size) {
  void* const memory = octosurf::test::fails() ? nullptr : std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return octosurf::test::fails() ? nullptr : std::malloc(size == 0 ? 1 : size);
}

void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto edge = static_cast<std::size_t>(alignment);
  const std::size_t whole = (size + edge - 1) / edge * edge;
  void* const memory =
      octosurf::test::fails() ? nullptr : std::aligned_alloc(edge, whole == 0 ? edge : whole);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
