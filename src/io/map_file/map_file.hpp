#pragma once

#include "io/map_file/map_rows.hpp"
#include "io/map_file/records.hpp"
#include "surfaces/map_state.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <semaphore>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace octosurf::io {

// The map file, `NAME.surfaces`: an SQLite database (application_id "OCSF", user_version that of the format,
// pages of 4096 bytes). Its tables hold a row of
//
//   state         header_key: a Header; files_key: the Files, with what all other rows add up to
//   octree        each part of the octree, by its path (for_each_part() of occupancy_map.hpp)
//   waiting       each cube of 64³ voxels with waiting points, by its coordinates / 64 packed as a voxel's;
//                 from first_blocks on, blocks that wait
//   held          each values_per_row scans that are remembered, from 0 on
//   surfaces, cylinders   each, by id
//   removals      each values_per_row, oldest first, from 0 on
//   seen_patches  each block (SeenPatches::block_of())
//   kept_scans    each values_per_row scans' poses and marks, from 0 on
//   padding       zeros, where the map shrinks to less than records.hpp wants
//
// with key, the map's revision when it was written, number of bytes, sum (CRC-32 of the table's number in a
// byte, the key in 8, and the content, times 2³², plus the content's Adler-32), and the content: a protobuf
// message of map_file.proto, in `octree` bytes, in a zstd frame each.
//
// A part's bytes are its nodes in preorder. Each begins with a byte that says which of its eight children
// follow (bit c: child c, which lies in the upper half along x if c & 1, y if c & 2, z if c & 4). Where it is
// 0, the node is a leaf: a float32 with its log-odds, a byte 1 or 0, and after a 1 the voxel's point in 8
// bytes, as a uint64 from its low bits on: 24 bits of its surface's id (0: pending), 3 × 8 bits position (x,
// y, z), 12 bits direction it was seen from (two octahedral coordinates of 6 bits, value/31.5 − 1), 4 bits
// distance class (1 … 15: about 0.25 m · √2^(class−1)). The point is (key − 2¹⁵ + (position + ½)/256) ·
// resolution. An inner node's log-odds is the largest of its children's. A surface's inliers are the points
// that carry its id; that is the only place they are in.
//
// A save replaces the rows that differ, in one transaction. Protobuf's numbered fields allow additions, and
// parameters are stored by name; other versions are refused. Maps may be untrusted: the schema is compared,
// lengths, counts and what rows decompress to are checked before allocation, and every number is.

inline constexpr std::uint32_t map_file_id = 0x4f435346;
inline constexpr std::uint32_t map_file_version = 8;
inline constexpr std::int64_t first_blocks = std::int64_t{1} << 48;
inline constexpr std::size_t values_per_row = 64;

/// Size and CRC-32 (zlib's) of a file.
struct FileSum {
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
  friend bool operator==(const FileSum&, const FileSum&) = default;
};

/// Nothing if the file cannot be read.
std::optional<FileSum> sum_of(const std::filesystem::path& file);

/// What a map's file has besides the map.
struct MapFiles {
  /// Of the .bt written last, and of the one before, which is still there if a save ended between the two.
  std::vector<FileSum> bt{};
  std::uint64_t bt_revision = 0;  ///< of the map in the first
  KeptScans scans{};              ///< the folder as in the file
  std::uint64_t sum = 0;          ///< RowSums::files_sum()
};

/// The file that a map was read from or saved to last: MapState::saved.
struct SavedMap {
  std::binary_semaphore turn{1};            ///< of one save at a time
  std::filesystem::path file{};             ///< canonical; empty: none, or of unknown content
  RowSums rows{};                           ///< in it
  std::uint64_t history = 0;                ///< of the octree in it …
  std::uint32_t shares = 0;                 ///< … and how often that had been shared before
  std::set<std::int64_t> changed_blocks{};  ///< of seen patches, since then
};
SavedMap& saved_of(const surfaces::MapState& state);  ///< made at the first call

/// All that a map file has of a map. Made while the map stands still, in O(surfaces, cylinders, scans, what
/// waits, and what has changed since `before`); then it may be written by any thread.
class MapHead {
 public:
  /// `before`: whose rows of what has not changed are kept; null: all are written.
  MapHead(const surfaces::MapState& state, OccupancyView octree, const SavedMap* before);
  /// Makes the outlines that nobody has read. Throws Error(output), also if a reader would refuse a row.
  void write(RowWriter& rows, const MapFiles& files) const;
  /// Once it was written: memory for reading it, as the reader counts; a quarter more, because pools grow in
  /// steps.
  std::uint64_t memory(const KeptScans& scans) const;
  const OccupancyView& octree() const { return octree_; }
  std::uint64_t revision() const { return limits_.revision; }

 private:
  void write_surfaces(RowWriter& rows) const;
  void write_queue(RowWriter& rows) const;

  SurfaceLimits limits_;
  std::string header_;
  OccupancyView octree_;
  std::uint64_t memory_;
  bool anew_;
  std::optional<std::uint32_t> since_;
  surfaces::PendingQueue queue_;
  std::vector<std::uint64_t> held_;
  RemovalLog removals_;
  std::vector<std::pair<surfaces::SurfaceModel::State, std::uint64_t>> surfaces_;  // and inliers
  std::function<std::shared_ptr<const Snapshot>()> read_snapshot_;
  mutable std::shared_ptr<const Snapshot> snapshot_;  // from write() on
  std::vector<std::pair<CylinderId, std::string>> cylinders_;
  std::vector<std::pair<alignment::SeenPatches::Key, std::vector<alignment::SeenPatches::Change>>> patches_;
};

struct MapFile {
  std::unique_ptr<surfaces::MapState> state;  ///< snapshot included
  MapFiles files;
};

/// Reads a map file. Throws Error(data) for whatever is not a map file of this version, whole and consistent.
MapFile read_map(const std::filesystem::path& file);

/// Without the scans' poses; nothing if the file is not there, cannot be read or is no map file.
MapFiles files_of(const std::filesystem::path& file);

/// One save of a map: made while the map stands still, run once by any thread. Until then, or until it is
/// destroyed, the next one of the same map waits.
class MapSave {
 public:
  /// `with_bt`: also the .bt. Throws as save_map().
  MapSave(const Map& map, const std::filesystem::path& stem, const KeptScans& scans, bool with_bt);
  ~MapSave();
  std::string operator()();  ///< writes; returns and throws as save_map()

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace octosurf::io
