#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace octosurf::occupancy {

/// Objects by index in chunks that never move; freed ones are handed out again first. Indices start
/// at 0. O(1) each.
///
/// A copy can be taken that shares the chunks: then the first write to each copies it, so that the copy's
/// readers, in whatever thread, never see one. In the same way what is done from begin_changes() on can be
/// taken back, at the cost of a copy of each chunk that is written to.
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
      chunks_.push_back({std::make_unique<T[]>(chunk_size), period_, false});
    const auto index = static_cast<std::uint32_t>(used_);
    writable(index);
    ++used_;
    return index;
  }
  void release(std::uint32_t index) { free_.push_back(index); }

  const T& operator[](std::uint32_t index) const {
    return chunks_[index >> chunk_bits].objects[index & (chunk_size - 1)];
  }
  /// The reference stays good until the next share() or begin_changes().
  T& writable(std::uint32_t index) {
    Chunk& chunk = chunks_[index >> chunk_bits];
    if (chunk.written_in != period_) make_writable(chunk);
    return chunk.objects[index & (chunk_size - 1)];
  }

  /// What is here now, for reading only: make(), release() and bytes() of it mean nothing. O(chunks).
  Pool share() {
    Pool copy;
    copy.chunks_ = chunks_;
    for (Chunk& chunk : chunks_) chunk.shared = true;
    ++period_;
    return copy;
  }

  /// From here on until commit() or roll_back() what is there now is kept. O(1).
  void begin_changes() {
    ++period_;
    open_ = true;
    before_ = {chunks_.size(), used_, free_.size()};
  }
  void commit() noexcept { close(); }
  /// Everything as it was at begin_changes(). O(chunks written to since).
  void roll_back() noexcept {
    for (; kept_count_ > 0; --kept_count_) {  // a chunk's first copy last
      KeptChunk& kept = kept_[kept_count_ - 1];
      std::swap(chunks_[kept.place], kept.chunk);
    }
    chunks_.resize(before_.chunks);
    used_ = before_.used;
    free_.resize(before_.free);
    free_.insert(free_.end(), taken_.rbegin(), taken_.rend());  // there was room for them
    close();
  }

  /// Of the objects in use: what the pool holds in reserve depends on the past, this does not.
  std::size_t bytes() const { return (used_ - free_.size()) * sizeof(T); }

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
    std::size_t free = 0;  ///< of those that were free at begin_changes(), how many have not been taken since
  };

  /// At a chunk's first write in a period: to a copy of its own, if somebody else wants it as it is.
  void make_writable(Chunk& chunk) {
    const auto place = static_cast<std::size_t>(&chunk - chunks_.data());
    const bool keep = open_ && place < before_.chunks;
    if (keep) {
      if (kept_count_ == kept_.size()) kept_.emplace_back();
      KeptChunk& kept = kept_[kept_count_];
      if (!kept.chunk.objects || kept.chunk.shared) kept.chunk.objects = uninitialized();
      std::copy_n(chunk.objects.get(), chunk_size, kept.chunk.objects.get());
      std::swap(kept.chunk.objects, chunk.objects);
      kept.chunk.shared = std::exchange(chunk.shared, false);
      kept.place = place;
      ++kept_count_;
    } else if (chunk.shared) {
      std::shared_ptr<T[]> own = uninitialized();
      std::copy_n(chunk.objects.get(), chunk_size, own.get());
      chunk.objects = std::move(own);
      chunk.shared = false;
    }
    chunk.written_in = period_;
  }
  static std::shared_ptr<T[]> uninitialized() { return std::make_unique_for_overwrite<T[]>(chunk_size); }
  /// Before one of the free is taken.
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
  /// As they were, in the order in which they were written to; behind these, chunks for the next ones.
  std::vector<KeptChunk> kept_;
  std::size_t kept_count_ = 0;
  std::vector<std::uint32_t> taken_;  ///< of those that were free, in the order in which they were taken
};

}  // namespace octosurf::occupancy
