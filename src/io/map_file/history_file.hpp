#pragma once

#include <cstdint>
#include <string_view>

namespace octosurf::io {

// A map's history as a file, all numbers little-endian:
//
//   8 bytes   magic: 89 'O' 'C' 'T' 'S' 'H' 0D 0A
//   4 bytes   version of the format, uint32
//   the rest  one zstd frame of records, each behind its length as a varint, as in a map file (map_file.hpp);
//             a record is a protobuf message `Record` of history_file.proto with exactly one field
//
// A moment has what differs from the one before it: a run of weeks repeats most of a map 256 times.

inline constexpr std::string_view history_file_magic{"\x89OCTSH\r\n", 8};
inline constexpr std::uint32_t history_file_version = 1;
inline constexpr double history_step_m = 1e-4;  ///< of vertices, as History rounds them

}  // namespace octosurf::io
