#pragma once

#include <cstdint>
#include <string_view>

namespace octosurf::io {

/// Shared by MCAP's reader and writer (mcap.dev/spec). A file begins and ends with it.
inline constexpr std::string_view mcap_magic("\x89MCAP0\r\n", 8);

/// A record's first byte.
enum class McapOp : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  data_end = 15,
};

}  // namespace octosurf::io
