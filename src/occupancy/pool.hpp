#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace octosurf {

/// Objects by index in chunks that never move; freed ones are handed out again first. Indices start
/// at 0. O(1) each. A copy can be taken that shares the chunks: then the first write to each copies it, so
/// that the copy's readers, in whatever thread, never see one.
template <class T, unsigned chunk_bits>
class Pool {
 public:
  Pool() = default;
  Pool(Pool&&) noexcept = default;
  Pool& operator=(Pool&&) noexcept = default;

  std::uint32_t make() {
    if (!free_.empty()) {
      const std::uint32_t index = free_.back();
      writable(index) = T{};
      free_.pop_back();
      return index;
    }
    if (used_ == chunks_.size() << chunk_bits) chunks_.push_back({std::make_unique<T[]>(chunk_size)});
    const auto index = static_cast<std::uint32_t>(used_);
    writable(index);
    ++used_;
    return index;
  }
  void release(std::uint32_t index) { free_.push_back(index); }

  const T& operator[](std::uint32_t index) const {
    return chunks_[index >> chunk_bits].objects[index & (chunk_size - 1)];
  }
  /// The reference stays good until the next share().
  T& writable(std::uint32_t index) {
    Chunk& chunk = chunks_[index >> chunk_bits];
    if (chunk.shared) unshare(chunk);
    return chunk.objects[index & (chunk_size - 1)];
  }

  /// What is here now, for reading only: make(), release() and bytes() of it mean nothing. O(chunks).
  Pool share() {
    for (Chunk& chunk : chunks_) chunk.shared = true;
    Pool copy;
    copy.chunks_ = chunks_;
    return copy;
  }

  /// Of the objects in use: what the pool holds in reserve depends on the past, this does not.
  std::size_t bytes() const { return (used_ - free_.size()) * sizeof(T); }

 private:
  static constexpr std::size_t chunk_size = std::size_t{1} << chunk_bits;
  struct Chunk {
    std::shared_ptr<T[]> objects;
    bool shared = false;
  };
  static void unshare(Chunk& chunk) {
    std::shared_ptr<T[]> own = std::make_unique_for_overwrite<T[]>(chunk_size);
    std::copy_n(chunk.objects.get(), chunk_size, own.get());
    chunk = {std::move(own), false};
  }

  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;
};

}  // namespace octosurf
