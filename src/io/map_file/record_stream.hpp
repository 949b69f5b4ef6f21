#pragma once

#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>
#include <zstd.h>

#include <octosurf/error.hpp>

namespace octosurf::io {

/// Largest record of a map file, in bytes.
inline constexpr std::size_t record_limit = std::size_t{64} << 20;

/// Limit of counts in files; larger ones are damage. Increments from here cannot overflow.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 48;

/// Reports damage of a file as an Error(data): "`where`: is damaged: `of` `what`".
struct Damage {
  std::string where, of;
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Error::Kind::data, where, "is damaged: " + of + what, "restore it from a backup");
  }
  void require(bool holds, const char* what) const {
    if (!holds) fail(what);
  }
};

/// Limit of a file's expansion on reading: a constant plus a multiple of its size.
struct Expansion {
  std::uint64_t free = 0, ratio = 1;
  std::uint64_t most(std::uint64_t file_bytes) const { return free + ratio * file_bytes; }
  /// Minimum file size for an expansion to `bytes`.
  std::uint64_t least_file(std::uint64_t bytes) const {
    return bytes <= free ? 0 : (bytes - free + ratio - 1) / ratio;
  }
};

/// Writes records, each after its length as a varint, in a single zstd frame. Same records, same bytes.
class RecordWriter {
 public:
  explicit RecordWriter(std::ostream& out);

  /// Throws Error(output) if the record is larger than the limit. Check the stream's state for write errors.
  void put(std::string_view record);

  /// Ends the frame. Pads to `least_bytes` with zeros in a skippable frame, so as not to look like a bomb.
  void finish(std::uint64_t least_bytes = 0);

  std::uint64_t records() const { return records_; }
  std::uint64_t bytes() const { return taken_; }  ///< before compression, lengths included
  std::uint32_t crc32() const { return crc_; }    ///< of all bytes before compression, lengths included

 private:
  void take(std::string_view bytes);
  void compress(std::string_view bytes, ZSTD_EndDirective mode);
  void write(std::string_view bytes);

  std::ostream& out_;
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context_{ZSTD_createCCtx(), &ZSTD_freeCCtx};
  std::vector<char> buffer_ = std::vector<char>(ZSTD_CStreamOutSize());
  std::uint32_t crc_ = 0;
  std::uint64_t records_ = 0, taken_ = 0, written_ = 0;
};

/// Reads records from untrusted input; those over the limit, and streams over `budget` bytes, are rejected.
class RecordReader : Damage {
 public:
  /// `name`: the file's, in messages.
  RecordReader(std::istream& in, std::uint64_t budget, std::string name);

  /// False at the end of the frame, which must be the end of the stream except for zeros in a skippable
  /// frame. Throws Error(data).
  bool next(std::string& record);

  std::uint64_t records() const { return records_; }  ///< read so far
  /// Of all decompressed bytes before the last record and its length.
  std::uint32_t crc32_before_last() const { return crc_before_last_; }

 private:
  /// Decompresses until a byte is available; false at the end of the frame.
  bool refill();
  void read_more();
  void end_frame();
  bool has_packed() { return input_.pos != input_.size || in_.peek() != std::istream::traits_type::eof(); }
  unsigned char next_packed();
  /// Up to `most` available bytes; call refill() first.
  std::string_view take(std::size_t most);
  std::optional<std::size_t> read_length();

  std::istream& in_;
  std::uint64_t budget_;
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context_{ZSTD_createDCtx(), &ZSTD_freeDCtx};
  std::vector<char> packed_ = std::vector<char>(ZSTD_DStreamInSize());
  std::vector<char> plain_ = std::vector<char>(ZSTD_DStreamOutSize());
  ZSTD_inBuffer input_{packed_.data(), 0, 0};
  ZSTD_outBuffer output_{plain_.data(), plain_.size(), 0};
  std::size_t position_ = 0;  // in `output_`
  bool ended_ = false;
  std::uint32_t crc_ = 0, crc_before_last_ = 0;
  std::uint64_t records_ = 0;
};

}  // namespace octosurf::io
