#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/bounded_file.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf::io {

/// A bag whose messages are in blocks that are decompressed as a whole: a MessagePlace's block is the byte at
/// which the block's record begins, its offset is within the decompressed block.
class ChunkedBag : public Bag {
 public:
  std::string_view read(const MessagePlace& place) override {
    if (cached_ != place.block) {
      cached_.reset();
      file_.seek(place.block);
      cache_ = read_block(place.block);
      cached_ = place.block;
    }
    if (place.offset > cache_.size() || place.size > cache_.size() - place.offset)
      file_.refuse("changed while it was read");
    return std::string_view(cache_).substr(place.offset, place.size);
  }

 protected:
  static constexpr const char* hint = "copy the bag again; --skip-bad maps what is whole";

  /// `format` is named in errors.
  ChunkedBag(const std::filesystem::path& file, const char* format) : file_(file), format_(format) {}

  /// The block whose record begins at `begin`, where the file stands.
  virtual std::string read_block(std::uint64_t begin) = 0;

  /// A chunk's content, of stated size `size`.
  std::string unpacked(std::string_view packed, std::string_view compression, std::uint64_t size) const {
    if (size > largest_block(file_.size()))
      fail_reading("a chunk of " + std::to_string(size) + " bytes, far more than the file's size");
    return decompressed(packed, compression, size);
  }

  /// Calls `work` for the record at byte `begin`; its exceptions become an Error with the position.
  template <class Work>
  auto parse(std::uint64_t begin, const Work& work) const -> decltype(work()) {
    return with_place(work, [&](const std::string& what) { return damage(begin, what); });
  }

  Error damage(std::uint64_t begin, const std::string& what) const {
    return {
        Error::Kind::data, file_.path().string(),
        std::string("damaged ") + format_ + ": " + what + " (record at byte " + std::to_string(begin) + ")",
        hint};
  }

  BoundedFile file_;

 private:
  const char* format_;
  std::string cache_;
  std::optional<std::uint64_t> cached_;  // the block in cache_
};

}  // namespace octosurf::io
