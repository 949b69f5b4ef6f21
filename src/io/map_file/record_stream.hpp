#pragma once

#include <cstdint>
#include <istream>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>

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

/// Writes records, each after its length as a base-128 varint (protobuf's "delimited" convention), in a
/// single zstd frame. Same records, same bytes.
class RecordWriter {
 public:
  explicit RecordWriter(std::ostream& out);
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;
  ~RecordWriter();

  /// Throws Error(output) if the record is larger than the limit. Check the stream's state for write errors.
  void put(std::string_view record);
  /// Ends a block of the compressor, so that the next data have their own frequency tables.
  void end_block();
  /// Ends the frame. Pads to `least_bytes` with zeros in a skippable zstd frame, so that a highly
  /// compressible map does not look like a decompression bomb.
  void finish(std::uint64_t least_bytes = 0);

  std::uint64_t records() const;
  std::uint64_t bytes() const;  ///< before compression, lengths included
  std::uint32_t crc32() const;  ///< of all bytes before compression, lengths included

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads records from untrusted input: memory grows with the bytes actually read; records over the limit and
/// streams that decompress to over `budget` bytes are rejected.
class RecordReader {
 public:
  /// `where` names the file in messages.
  RecordReader(std::istream& in, std::uint64_t budget, std::string where);
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;
  ~RecordReader();

  /// False at the end of the frame, which must be the end of the stream except for zeros in a skippable
  /// frame. Throws Error(data).
  bool next(std::string& record);

  std::uint64_t records() const;  ///< read so far
  /// Of all decompressed bytes before the last record and its length.
  std::uint32_t crc32_before_last() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf::io
