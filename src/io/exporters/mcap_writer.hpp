#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

namespace octosurf::io {

struct McapMessage {
  std::string topic, type;  ///< all of a topic are of one type
  std::uint64_t time_ns = 0;
  std::string bytes;
};

/// Writes an MCAP file (mcap.dev/spec) of Protobuf messages, whose types the FileDescriptorSet `descriptors`
/// defines: one chunk (zstd) with its indices, and a summary. Debian has no library for it. `out`: binary, at
/// its beginning; write errors set its state.
void write_mcap(std::ostream& out, const std::vector<McapMessage>& messages, const std::string& descriptors);

}  // namespace octosurf::io
