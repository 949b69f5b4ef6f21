#pragma once

#include <cstdint>
#include <string_view>
#include <zlib.h>

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
  summary_offset = 14,
  data_end = 15,
};

/// Continues the checksum `before` with `bytes`.
inline std::uint32_t mcap_crc(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace octosurf::io
