#pragma once

#include <cstddef>
#include <filesystem>
#include <type_traits>

namespace octosurf::geometry {

/// The memory of what grows with a map. Once a file is open it is mapped from there, so that parts which
/// nobody uses can leave the process: whoever touches them later gets them back, at the cost of a page fault
/// or a read. Neighbours in time are neighbours in the file, so what a robot leaves behind leaves together.
///
/// 1. Without a file: the heap's memory.
/// 2. The file has no name: it goes with the process, however that ends.
/// 3. Its blocks are reserved on the disk before they are used: a full disk is an Error from allocate(), not
/// a
///    signal at a later write.
/// 4. drop() changes no content, and may run while other threads read and write.
class PageFile {
 public:
  /// In this folder, for the whole process; before any map is made. Throws Error(output), and Error(usage)
  /// for a second one.
  static void open(const std::filesystem::path& folder);

  /// From the file 64-byte aligned, from a page's start if it takes pages. Throws Error(output) or
  /// std::bad_alloc. Any thread.
  static void* allocate(std::size_t bytes);
  static void deallocate(void* block, std::size_t bytes) noexcept;

  /// Takes the file out of the process, but for so many bytes that were used for the first time last. The
  /// system writes it when it needs the memory.
  static void drop(std::size_t keep = 0) noexcept;
};

/// For standard containers of what grows with a map.
template <class T>
struct PagedAllocator {
  using value_type = T;
  using is_always_equal = std::true_type;
  PagedAllocator() = default;
  template <class U>
  PagedAllocator(const PagedAllocator<U>&) noexcept {}  // NOLINT(google-explicit-constructor): rebinding

  T* allocate(std::size_t n) {
    static_assert(alignof(T) <= 16);
    return static_cast<T*>(PageFile::allocate(n * sizeof(T)));
  }
  void deallocate(T* block, std::size_t n) noexcept { PageFile::deallocate(block, n * sizeof(T)); }
  friend bool operator==(const PagedAllocator&, const PagedAllocator&) { return true; }
};

}  // namespace octosurf::geometry
