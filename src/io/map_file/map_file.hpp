#pragma once

#include "surfaces/map_state.hpp"

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <ostream>
#include <string>

namespace octosurf::io {

// The map file, `NAME.surfaces`. All numbers little-endian.
//
//   8 bytes   magic: 89 'O' 'C' 'T' 'S' 'F' 0D 0A (as PNG's: text-mode transfer breaks it)
//   4 bytes   version of the format, uint32
//   the rest  one zstd frame (window at most 8 MiB): records, each behind its length as a varint;
//             behind it, where the map shrinks to less than records.hpp wants, a skippable frame of zeros
//
// A record is a protobuf message `Record` of map_file.proto with exactly one field. In order: one
// Header; the octree in chunks; Accumulated; ScanPoses; Surfaces, then Cylinders, by ascending id;
// Removals; SeenPatches; one Footer with the number of records before it and the CRC-32 (zlib's) of all
// decompressed bytes before its length.
//
// The octree chunks, put together, are the nodes in preorder, from the root over all 2¹⁶ voxels an
// axis. Each begins with a byte that says which of its eight children follow (bit c: child c, which
// lies in the upper half along x if c & 1, y if c & 2, z if c & 4). Where it is 0, the node is a
// leaf: a float32 with its log-odds, a byte 1 or 0, and after a 1 the voxel's point in 8 bytes, as a
// uint64 from its low bits on: 24 bits surface id (0: pending), 3 × 8 bits position (x, y, z), 12 bits
// direction it was seen from (two octahedral coordinates of 6 bits, value/31.5 − 1), 4 bits distance
// class (1 … 15: about 0.25 m · √2^(class−1)). The point is (key − 2¹⁵ + (position + ½)/256) ·
// resolution. An inner node's log-odds is the largest of its children's. A map without any voxel has
// no chunk. A surface's inliers are the points that carry its id; that is the only place they are in.
//
// Protobuf's numbered fields allow additions, and parameters are stored by name; other versions are refused.
// Maps may be untrusted: lengths, counts and what the stream decompresses to are checked before allocation,
// and every number is. The octree is raw bytes, because a message per node would take ten times its size.

inline constexpr std::string_view map_file_magic{"\x89OCTSF\r\n", 8};
inline constexpr std::uint32_t map_file_version = 7;

/// Size and CRC-32 (zlib's) of a file.
struct FileSum {
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
  friend bool operator==(const FileSum&, const FileSum&) = default;
};

/// Nothing if the file cannot be read.
std::optional<FileSum> sum_of(const std::filesystem::path& file);

/// Writes a map file. Same state, same bytes. `bt` is of the accompanying .bt. Write errors set the stream's
/// state.
void write_map(const surfaces::MapState& state, const FileSum& bt, std::ostream& out,
               const KeptScans& scans = {});

struct MapFile {
  std::unique_ptr<surfaces::MapState> state;  ///< snapshot included
  FileSum bt;                                 ///< of the accompanying .bt
  KeptScans scans;                            ///< the folder as in the file
};

/// Reads a map file of `file_bytes` bytes; `where` names it in messages. Throws Error(data) for
/// whatever is not a map file of this version, whole and consistent.
MapFile read_map(std::istream& in, std::uint64_t file_bytes, const std::string& where);

/// Of the .bt that was written with this map file; nothing if it is not there, cannot be read or is damaged:
/// its checksum is compared, its contents are not.
std::optional<FileSum> octree_sum_of(const std::filesystem::path& file);

}  // namespace octosurf::io
