#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace octosurf::occupancy {

/// Objects by index in chunks that never move; freed ones are reused first. Indices start at 0. O(1) each.
///
/// share() returns a copy with the same chunks: the first write to each then copies it, so readers of the
/// copy, in any thread, see no changes. Likewise changes since begin_changes() can be rolled back, at the
/// cost of a copy of each chunk written to.
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
      note_taken();
      free_.pop_back();
      return index;
    }
    if (used_ == chunks_.size() << chunk_bits)
      chunks_.push_back({std::make_shared<T[]>(chunk_size), period_, false});
    const auto index = static_cast<std::uint32_t>(used_);
    writable(index);
    ++used_;
    return index;
  }
  void release(std::uint32_t index) { free_.push_back(index); }

  const T& operator[](std::uint32_t index) const {
    return chunks_[index >> chunk_bits].objects[index & (chunk_size - 1)];
  }
  /// The reference stays valid until the next share() or begin_changes().
  T& writable(std::uint32_t index) {
    Chunk& chunk = chunks_[index >> chunk_bits];
    if (chunk.written_in != period_) make_writable(chunk);
    return chunk.objects[index & (chunk_size - 1)];
  }

  /// A read-only copy: make(), release() and bytes() of it are meaningless. O(chunks).
  Pool share() {
    Pool copy;
    copy.chunks_ = chunks_;
    for (Chunk& chunk : chunks_) chunk.shared = true;
    ++period_;
    return copy;
  }

  /// Starts recording the previous state until commit() or roll_back(). O(1).
  void begin_changes() {
    ++period_;
    open_ = true;
    before_ = {chunks_.size(), used_, free_.size()};
  }
  void commit() noexcept { close(); }
  /// Restores the state at begin_changes(). O(chunks written to since).
  void roll_back() noexcept {
    for (; kept_count_ > 0; --kept_count_) {  // a chunk's first copy last
      KeptChunk& kept = kept_[kept_count_ - 1];
      std::swap(chunks_[kept.place], kept.chunk);
    }
    chunks_.resize(before_.chunks);
    used_ = before_.used;
    free_.resize(before_.free);
    free_.insert(free_.end(), taken_.rbegin(), taken_.rend());  // within its capacity
    close();
  }

  std::size_t size() const { return used_ - free_.size(); }  ///< objects in use
  /// Of the objects in use: the reserve depends on history, this does not.
  std::size_t bytes() const { return size() * sizeof(T); }

 private:
  static constexpr std::size_t chunk_size = std::size_t{1} << chunk_bits;
  struct Chunk {
    std::shared_ptr<T[]> objects;
    std::uint64_t written_in = 0;
    bool shared = false;
  };
  struct KeptChunk {
    std::size_t place = 0;
    Chunk chunk;
  };
  struct Sizes {
    std::size_t chunks = 0, used = 0;
    std::size_t free = 0;  ///< number of entries of free_ at begin_changes() that were not reused since
  };

  /// At a chunk's first write in a period: replaces it by a copy, if it is shared or must be kept.
  void make_writable(Chunk& chunk) {
    const auto place = static_cast<std::size_t>(&chunk - chunks_.data());
    const bool keep = open_ && place < before_.chunks;
    if (keep) {
      if (kept_count_ == kept_.size()) kept_.emplace_back();
      KeptChunk& kept = kept_[kept_count_];
      if (!kept.chunk.objects || kept.chunk.shared)
        kept.chunk.objects = std::make_shared_for_overwrite<T[]>(chunk_size);
      std::copy_n(chunk.objects.get(), chunk_size, kept.chunk.objects.get());
      std::swap(kept.chunk.objects, chunk.objects);
      kept.chunk.shared = std::exchange(chunk.shared, false);
      kept.place = place;
      ++kept_count_;
    } else if (chunk.shared) {
      std::shared_ptr<T[]> own = std::make_shared_for_overwrite<T[]>(chunk_size);
      std::copy_n(chunk.objects.get(), chunk_size, own.get());
      chunk.objects = std::move(own);
      chunk.shared = false;
    }
    chunk.written_in = period_;
  }
  /// Call before a free object is reused.
  void note_taken() {
    if (!open_ || free_.size() > before_.free) return;
    taken_.push_back(free_.back());
    --before_.free;
  }
  void close() noexcept {
    open_ = false;
    for (KeptChunk& kept : std::span(kept_).first(kept_count_))
      if (kept.chunk.shared) kept.chunk = {};  // it belongs to readers
    if (const std::size_t enough = 2 * kept_count_ + 1; kept_.size() > enough) kept_.resize(enough);
    kept_count_ = 0;
    taken_.clear();
  }

  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;

  std::uint64_t period_ = 1;  ///< ends at each share() and begin_changes()
  bool open_ = false;         ///< between begin_changes() and its end
  Sizes before_;
  /// Previous contents, in order of the writes; behind these, spare chunks.
  std::vector<KeptChunk> kept_;
  std::size_t kept_count_ = 0;
  std::vector<std::uint32_t> taken_;  ///< reused free indices, in order
};

}  // namespace octosurf::occupancy
