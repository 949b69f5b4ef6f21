#pragma once

#include <cstdint>
#include <istream>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>

namespace octosurf::io {

/// Largest record of a map file, in bytes.
inline constexpr std::size_t record_limit = std::size_t{64} << 20;

/// Counts in files are smaller; larger ones are damage. Counts that go on from there do not wrap.
inline constexpr std::uint64_t largest_count = std::uint64_t{1} << 48;

/// What a file may become when it is read: so many bytes whatever its size, and so many times its size.
struct Expansion {
  std::uint64_t free = 0, ratio = 1;
  std::uint64_t most(std::uint64_t file_bytes) const { return free + ratio * file_bytes; }
  /// Bytes that a file needs to become `bytes`.
  std::uint64_t least_file(std::uint64_t bytes) const {
    return bytes <= free ? 0 : (bytes - free + ratio - 1) / ratio;
  }
};

/// Records one after the other, each behind its length as a base-128 varint (protobuf's
/// "delimited" convention), in a single zstd frame. Same records, same bytes.
class RecordWriter {
 public:
  explicit RecordWriter(std::ostream& out);
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;
  ~RecordWriter();

  /// Throws Error(output) if the record is larger than the limit. Whether the stream took the bytes
  /// is for its owner to look at.
  void put(std::string_view record);
  /// Ends a block of the compressor, so that what follows is coded by its own frequencies.
  void end_block();
  /// Ends the frame. If less than `least_bytes` are written then, zeros follow in a frame of zstd that its
  /// decoders skip: what shrinks so far must not look like a file that is made to fill a reader's memory.
  void finish(std::uint64_t least_bytes = 0);

  std::uint64_t records() const;
  std::uint64_t bytes() const;  ///< before compression, lengths included
  std::uint32_t crc32() const;  ///< of all bytes before compression, lengths included

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads them back, trusting nothing: a record's memory grows with the bytes that have really come,
/// records over the limit and streams that decompress to over `budget` bytes are refused.
class RecordReader {
 public:
  /// `where` names the file in messages.
  RecordReader(std::istream& in, std::uint64_t budget, std::string where);
  RecordReader(const RecordReader&) = delete;
  RecordReader& operator=(const RecordReader&) = delete;
  ~RecordReader();

  /// False at the end of the frame, which must be the end of the stream but for zeros in a frame that is
  /// skipped. Throws Error(data).
  bool next(std::string& record);

  std::uint64_t records() const;  ///< read so far
  /// Of all decompressed bytes before the last record and its length.
  std::uint32_t crc32_before_last() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace octosurf::io
