#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace octosurf {

/// Objects by index in chunks that never move; freed ones are handed out again first. Indices start
/// at 0. O(1) each.
template <class T, unsigned chunk_bits>
class Pool {
 public:
  std::uint32_t make() {
    if (!free_.empty()) {
      const std::uint32_t index = free_.back();
      free_.pop_back();
      (*this)[index] = T{};
      return index;
    }
    if (used_ == chunks_.size() << chunk_bits) chunks_.push_back(std::make_unique<T[]>(chunk_size));
    return static_cast<std::uint32_t>(used_++);
  }
  void release(std::uint32_t index) { free_.push_back(index); }

  T& operator[](std::uint32_t index) { return chunks_[index >> chunk_bits][index & (chunk_size - 1)]; }
  const T& operator[](std::uint32_t index) const {
    return chunks_[index >> chunk_bits][index & (chunk_size - 1)];
  }

  /// Of the objects in use: what the pool holds in reserve depends on the past, this does not.
  std::size_t bytes() const { return (used_ - free_.size()) * sizeof(T); }

 private:
  static constexpr std::size_t chunk_size = std::size_t{1} << chunk_bits;
  std::vector<std::unique_ptr<T[]>> chunks_;
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;
};

}  // namespace octosurf
