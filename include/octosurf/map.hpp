#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::surfaces {
struct MapAccess;
struct MapState;
}  // namespace octosurf::surfaces

namespace octosurf {

/// Octree and surfaces after a number of scans: the persistent state. Move-only; a Mapper takes one over to
/// continue it. After a failed scan that is not yet rolled back (mapper.hpp, 4), everything but parameters()
/// and snapshot() throws Error(incomplete).
class Map {
 public:
  explicit Map(const Parameters& parameters = {});  ///< an empty map; validates the parameters
  Map(Map&&) noexcept;
  Map& operator=(Map&&) noexcept;
  ~Map();

  const Parameters& parameters() const;              ///< parameters it was made with
  std::shared_ptr<const Snapshot> snapshot() const;  ///< surfaces after the last complete scan

  /// The map frame's origin in the frame of the scans' poses, m: ScanSource::origin() when the map was begun.
  /// It was subtracted from all coordinates, and is saved with the map.
  Eigen::Vector3d origin() const;
  /// Throws Error(usage) unless it is finite.
  void set_origin(const Eigen::Vector3d& origin);

  /// The voxel that holds `point` (map frame); unknown outside the octree's range. O(depth).
  OccupancyView::Voxel at(const Eigen::Vector3d& point) const;

  /// The octree at this moment, readable from any thread while mapping continues; do not call during an
  /// insertion. With Mapper::share_octree() each snapshot() has one.
  OccupancyView octree() const;

  /// Calls `visit` for every occupied voxel that has a point, in Morton order. O(nodes).
  void for_each_point(const std::function<void(const OccupancyView::Voxel&)>& visit) const;

  /// Size of the map.
  struct Size {
    std::size_t nodes = 0;       ///< of the octree; some more than OctoMap's: cubes with points stay divided
    std::size_t leaves = 0;      ///< likewise
    std::size_t bytes = 0;       ///< of memory, octree
    std::size_t points = 0;      ///< occupied voxels with a point
    std::size_t pending = 0;     ///< points without a surface
    std::size_t surfaces = 0;    ///< number
    std::size_t inliers = 0;     ///< points on a surface
    std::uint64_t scans = 0;     ///< inserted so far
    std::uint64_t revision = 0;  ///< raised by every scan
  };
  Size size() const;  ///< O(surfaces)

  /// Whether a Mapper with remember_scans() inserted this scan, among the last 10⁵: compares a 64-bit hash of
  /// the given pose, the number of points and up to 4096 of them, bit by bit. O(1) in the scan's points, 0.3
  /// ns for each remembered scan.
  bool holds(const Scan& scan) const;

 private:
  friend struct surfaces::MapAccess;  // octosurf's own libraries
  explicit Map(std::unique_ptr<surfaces::MapState> state);
  std::unique_ptr<surfaces::MapState> state_;
};

/// Location of the scans that a map was built from (`octosurf map --keep-scans`), to rebuild it with
/// corrected poses.
struct KeptScans {
  std::filesystem::path folder;            ///< that holds all of them; empty: they are not kept
  bool shared = false;                     ///< with another map; only that one may continue the folder
  std::vector<Eigen::Isometry3d> poses{};  ///< with which each was mapped
  std::vector<std::uint32_t> marks{};      ///< by which the file of each is known; empty: not known
};

/// Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap). The first is changed in one
/// transaction, where this map was read from it or saved to it last, by what has changed since; else it is
/// written to a temporary file that is synced and renamed, as the second is. After a failure or crash the
/// .surfaces is the old one or the new one. A .bt that was not saved with a whole .surfaces beside it, such
/// as one that another tool has made or edited, is first kept, synced, as `stem`.edited.bt, or .edited-2.bt …
/// where an earlier one has that name; the warning that is returned, else empty, says so. The file records
/// the location of the map's `scans`, relative to itself if possible; by default none. Throws Error(usage) if
/// `stem` names a folder, Error(output), also for a symbolic link or a read-only file in the place of either,
/// and Error(incomplete) for an incomplete map.
std::string save_map(const Map& map, const std::filesystem::path& stem, const KeptScans& scans = {});

/// Sixteen digits for what a .surfaces holds of a map: the same for the same scans and parameters, whoever
/// saved it however often. O(map).
std::string digest_of(const Map& map);

/// Result of load_map().
struct LoadedMap {
  Map map;              ///< as it was saved
  std::string warning;  ///< empty, or e.g. that the .bt does not match
  KeptScans scans{};    ///< where its scans are, if they were kept
};
/// Reads `stem`.surfaces. Throws Error(data) for damaged or foreign files.
LoadedMap load_map(const std::filesystem::path& stem);

/// Resolution of an OctoMap file (.bt or .ot), m, from its header. Throws Error(data).
double read_octomap_resolution(const std::filesystem::path& file);

/// What of an OctoMap file (.bt or .ot) is ignored, such as the colours of a ColorOcTree; empty: nothing.
/// Throws Error(data).
std::string octomap_note(const std::filesystem::path& file);

/// The octree of an OctoMap file (.bt or .ot) of any type whose nodes begin with log-odds, without points or
/// surfaces yet: input of Mapper::detect_in_occupancy. The file's resolution replaces the parameters'. Throws
/// Error(data) for damaged or foreign files, Error(usage) for unsuitable parameters.
Map map_from_octomap(const std::filesystem::path& file, Parameters parameters);

/// The same from an octree's leaves in any order, on the grid of parameters.occupancy.resolution; where two
/// overlap, the later one wins. Throws Error(data) for invalid leaves, Error(usage) for unsuitable
/// parameters. adapters/octree.hpp uses this for an octomap::OcTree.
Map map_from_leaves(std::span<const OccupancyView::Leaf> leaves, const Parameters& parameters);

}  // namespace octosurf
