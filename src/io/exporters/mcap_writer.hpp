#pragma once

#include "io/mcap_format.hpp"

#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::io {

/// Writes an MCAP file (mcap.dev/spec) of Protobuf messages: chunks of about 1 MiB (zstd) with an index each,
/// and a summary at the end. Debian has no library for it. Write errors set the stream's state.
class McapWriter {
 public:
  /// `out`: binary, at its beginning.
  explicit McapWriter(std::ostream& out);

  /// `type`: of the messages, defined by the FileDescriptorSet `descriptors`. Returns the channel's number.
  std::uint16_t add_channel(std::string_view topic, std::string_view type, std::string_view descriptors);

  /// Messages may come in any order of time.
  void write(std::uint16_t channel, std::uint64_t time_ns, std::string_view message);

  /// Writes the last chunk and the summary; nothing may be written afterwards.
  void finish();

 private:
  using Op = McapOp;

  struct Place {
    std::uint64_t time_ns, offset;
  };
  struct Channel {
    std::uint64_t messages = 0;
    std::vector<Place> in_chunk;  ///< messages in the current chunk
  };
  /// First and last time of messages; both 0 if there are none.
  struct Span {
    std::uint64_t begin_ns = 0, end_ns = 0;
    bool empty = true;
    void extend(std::uint64_t begin_ns, std::uint64_t end_ns);
  };

  static void add_record(std::string& to, Op op, std::string_view content, std::string_view rest = {});
  void put(std::string_view bytes);
  void end_chunk();
  std::string statistics() const;

  std::ostream& out_;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;
  std::string chunk_;  ///< records of the current chunk
  Span chunk_span_, span_;
  std::vector<Channel> channels_;
  std::string schema_records_, channel_records_, chunk_indexes_;  ///< of the summary
  std::uint32_t chunks_ = 0;
};

}  // namespace octosurf::io
