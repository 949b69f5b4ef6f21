#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <mutex>
#include <new>
#include <string>
#include <type_traits>
#include <vector>

namespace octosurf::memory {

/// The memory of what grows with one map, mapped from a file, so that parts which nobody uses can leave the
/// process: whoever touches them later gets them back, at the cost of a page fault or a read. Neighbours in
/// time are neighbours in the file, so what a robot leaves behind leaves together.
///
/// 1. The file has no name: it goes with this object, or with the process, however that ends.
/// 2. Its blocks are reserved on the disk before they are used: a full disk is an Error from allocate(), not
///    a signal at a later write.
/// 3. drop() changes no content, and may run while other threads read and write.
class PageFile {
 public:
  /// In this folder. Throws Error(output).
  explicit PageFile(const std::filesystem::path& folder);
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;
  ~PageFile();  ///< its blocks are gone then

  /// 64-byte aligned, from a page's start if it takes pages. Throws Error(output) or std::bad_alloc. Any
  /// thread.
  void* allocate(std::size_t bytes);
  void deallocate(void* block, std::size_t bytes) noexcept;

  /// Evicts all pages except the `keep` bytes that were used for the first time last. The system writes them
  /// when it needs the memory.
  void drop(std::size_t keep = 0) noexcept;
  std::size_t used() const { return used_; }  ///< bytes, whether in memory or not

 private:
  PageFile() = default;
  void grow(std::size_t end);
  [[noreturn]] void fail(int cause) const;

  std::string folder_;
  int descriptor_ = -1;
  std::byte* begin_ = nullptr;
  std::mutex mutex_;                                // guards the rest
  std::atomic<std::size_t> used_ = 0, mapped_ = 0;  // read by drop()
  std::array<std::vector<void*>, 512> free_;
};

/// For standard containers of what grows with a map: from its file, or without one from the heap.
template <class T>
struct PagedAllocator {
  using value_type = T;
  using propagate_on_container_copy_assignment = std::true_type;
  using propagate_on_container_move_assignment = std::true_type;
  using propagate_on_container_swap = std::true_type;

  PagedAllocator(PageFile* from = nullptr) : file(from) {}  // NOLINT(google-explicit-constructor): brevity
  template <class U>
  PagedAllocator(const PagedAllocator<U>& other) noexcept  // NOLINT(google-explicit-constructor): rebinding
      : file(other.file) {}

  T* allocate(std::size_t n) {
    static_assert(alignof(T) <= 16);
    const std::size_t bytes = n * sizeof(T);
    return static_cast<T*>(file == nullptr ? ::operator new(bytes) : file->allocate(bytes));
  }
  void deallocate(T* block, std::size_t n) noexcept {
    if (file == nullptr)
      ::operator delete(block);
    else
      file->deallocate(block, n * sizeof(T));
  }
  friend bool operator==(const PagedAllocator&, const PagedAllocator&) = default;

  PageFile* file;
};

}  // namespace octosurf::memory
