#pragma once

#include "sensing/downsample.hpp"
#include "sensing/reading_code.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::io {

// A file of an archive of scans, `NNNNNN.scan`. All numbers little-endian.
//
//   8 bytes   magic: 89 'O' 'C' 'T' 'S' 'C' 0D 0A
//   4 bytes   version of the format, uint32
//   the rest  one zstd frame of records, each behind its length as a varint, as in a map file (map_file.hpp);
//             a record is a protobuf message `Record` of scan_archive.proto with exactly one field
//
// In order: Header; the distinct voxels that the scan's points ended in, on the map's grid at the pose with
// which it was mapped, in Morton order; in three records the x, y and z of the mean of each voxel's points;
// how many points that was; a Footer with the CRC-32 (zlib's) of all decompressed bytes before its length. A
// mean point is, in the map's frame, (key − 2¹⁵ + (place + ½)/256) · resolution: what the octree itself keeps
// of a point. The inverse of the pose brings it into the sensor's frame.
//
// Why this format. The scan was rounded to it before it was mapped (mapper/rounded_scan.hpp says to what, and
// why that costs nothing). Mapped again at the same pose it ends in the same voxels with the same points, and
// the map is the same, to the bit. Points beyond the map's range end in a voxel, too, so they are thinned
// alike and still free space. Points without a reading, nearer than min_range or outside the octree are not
// kept. A column a record, and a block of the compressor each, because each has frequencies of its own: 2.5
// … 3.5 bytes a voxel.

inline constexpr std::string_view archived_scan_magic{"\x89OCTSC\r\n", 8};
inline constexpr std::uint32_t archived_scan_version = 1;

/// What an archive tells of a scan beside its points.
struct ArchivedHeader {
  std::string name;
  double stamp_s = 0;
  SensorKind sensor = SensorKind::depth_camera;
  double resolution = 0;
  Eigen::Isometry3d T_given = Eigen::Isometry3d::Identity();  ///< that came with the scan
  Eigen::Isometry3d T_used = Eigen::Isometry3d::Identity();   ///< with which it was mapped
  std::vector<NoiseCount> noise{};
  std::vector<SharedVariance> shared_variances{};
};

struct ArchivedScan {
  struct Point {
    geometry::VoxelKey key;       ///< at T_used
    sensing::PlaceInVoxel place;  ///< of the mean of its readings
    std::uint16_t readings = 1;
  };
  ArchivedHeader header;
  std::vector<Point> points;  ///< Morton order, each voxel once

  /// In the sensor's frame, in the order of `points`; pose: T_used; name: the archived one's.
  Scan scan() const;
};

/// What is to be kept of a scan that was mapped. `header` says with which pose, and the grid's resolution.
ArchivedScan archived(ArchivedHeader header, const sensing::VoxelScan& voxels);

/// Same scan, same bytes. Write errors show in the stream.
void write_archived_scan(const ArchivedScan& scan, std::ostream& out);

/// Throws Error(data) naming the file for whatever is not an archived scan of this or an older version, whole
/// and consistent. Takes at most 64 MiB and 128 times the file's size of memory.
ArchivedScan read_archived_scan(const std::filesystem::path& file);

/// Its beginning only; the rest is not looked at.
ArchivedHeader read_archived_header(const std::filesystem::path& file);

}  // namespace octosurf::io
