#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

namespace octosurf::occupancy {

/// A sequence that grows at its end, page by page, and never moves its elements: references stay valid for
/// its lifetime. Like std::deque, with pages whose elements are found by a shift.
template <class T, unsigned page_bits = 10>
class PagedVector {
 public:
  std::size_t size() const { return size_; }

  /// Grows to `size` elements, new ones as T{}; smaller sizes change nothing.
  void grow_to(std::size_t size) {
    while (pages_.size() << page_bits < size) pages_.push_back(std::make_unique<T[]>(page_size));
    size_ = std::max(size_, size);
  }

  T& operator[](std::size_t i) { return pages_[i >> page_bits][i & (page_size - 1)]; }
  const T& operator[](std::size_t i) const { return pages_[i >> page_bits][i & (page_size - 1)]; }

 private:
  static constexpr std::size_t page_size = std::size_t{1} << page_bits;
  std::vector<std::unique_ptr<T[]>> pages_;
  std::size_t size_ = 0;
};

}  // namespace octosurf::occupancy
