#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::surfaces {
struct MapState;
}  // namespace octosurf::surfaces

namespace octosurf {

/// What a scan source, the octree and the surfaces amount to at one moment: the persistent thing.
/// Move-only. A Mapper takes one over to go on with it. After a scan that failed half-way (mapper.hpp, 4),
/// everything but parameters() and snapshot() throws Error(incomplete).
class Map {
 public:
  explicit Map(const Parameters& parameters = {});          ///< an empty map; validates the parameters
  explicit Map(std::unique_ptr<surfaces::MapState> state);  ///< used by readers of map files
  Map(Map&&) noexcept;
  Map& operator=(Map&&) noexcept;
  ~Map();

  const Parameters& parameters() const;              ///< those it was made with
  std::shared_ptr<const Snapshot> snapshot() const;  ///< its surfaces after the last whole scan

  /// What is known of a voxel.
  enum class Occupancy { unknown, free, occupied };
  /// All that the map has of a voxel.
  struct Voxel {
    Occupancy occupancy = Occupancy::unknown;  ///< by `log_odds` and Parameters
    float log_odds = 0;                        ///< ln(p / (1 − p)) of its being occupied; 0 if unknown
    SurfaceId surface = 0;                     ///< 0: pending, or not occupied
    std::optional<Eigen::Vector3d> point;      ///< representative point, map frame
    std::optional<Eigen::Vector3d> view;       ///< unit vector toward where it was seen from
  };
  /// The voxel that holds `point` (map frame); unknown outside the octree's range. O(depth).
  Voxel at(const Eigen::Vector3d& point) const;

  /// The octree as it is now, to be read from any thread while the map goes on; not while something inserts.
  /// A Mapper that is told to share_octree() has one in each snapshot().
  OccupancyView octree() const;

  /// Calls `visit` for every occupied voxel's point, in key order. O(nodes).
  void for_each_point(const std::function<void(const Voxel&)>& visit) const;

  /// How large the map is.
  struct Size {
    std::size_t nodes = 0;       ///< of the octree, as OctoMap counts them
    std::size_t leaves = 0;      ///< likewise
    std::size_t bytes = 0;       ///< of memory, octree
    std::size_t points = 0;      ///< occupied voxels that have one
    std::size_t pending = 0;     ///< of them, on no surface
    std::size_t surfaces = 0;    ///< number
    std::size_t inliers = 0;     ///< points on a surface
    std::uint64_t scans = 0;     ///< inserted so far
    std::uint64_t revision = 0;  ///< raised by every scan
  };
  Size size() const;  ///< O(surfaces)

  /// Whether a Mapper that remembered its scans (Mapper::remember_scans) has put this one into it: compares
  /// the pose that it was given with, its number of points and up to 4096 of them, bit by bit, by a 64-bit
  /// hash. O(1) in the scan's points, 0.3 ns for each scan that is remembered.
  bool holds(const Scan& scan) const;

  const surfaces::MapState& state() const;  ///< what is behind it; for octosurf's own rooms
  surfaces::MapState& state();              ///< likewise

 private:
  std::unique_ptr<surfaces::MapState> state_;
};

/// Where the scans that a map was built from are kept (`octosurf map --keep-scans`), so that it can be built
/// anew with corrected poses.
struct KeptScans {
  std::filesystem::path folder;            ///< that holds all of them; empty: they are not kept
  bool shared = false;                     ///< with another map, which may go on with it, as this one may not
  std::vector<Eigen::Isometry3d> poses{};  ///< with which each was mapped
};

/// Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap), each to a temporary file that is synced
/// and renamed: whenever that fails or the process dies, the files of before or the new ones are there.
/// Throws Error(output), and Error(incomplete) for a map that is not whole. The file remembers where the
/// map's `scans` are, relative to it where that can be said; by default that they are not kept.
void save_map(const Map& map, const std::filesystem::path& stem, const KeptScans& scans = {});

/// What load_map() read.
struct LoadedMap {
  Map map;              ///< as it was saved
  std::string warning;  ///< empty, or e.g. that the .bt does not match
  KeptScans scans{};    ///< where its scans are, if they were kept
};
/// Reads `stem`.surfaces; throws Error(data) for damaged or foreign files, never anything worse.
LoadedMap load_map(const std::filesystem::path& stem);

/// Resolution of an OctoMap file (.bt or .ot), m, from its header. Throws Error(data).
double read_octomap_resolution(const std::filesystem::path& file);

/// The octree of an OctoMap file (.bt or .ot), without points or surfaces yet: what
/// Mapper::detect_in_occupancy starts from. The file's resolution replaces the parameters'.
/// Throws Error(data) for damaged or foreign files, Error(usage) for parameters that do not suit.
Map map_from_octomap(const std::filesystem::path& file, Parameters parameters);

/// The same from an octree's leaves in any order, on the grid of parameters.occupancy.resolution; where two
/// overlap, the later one counts. Throws Error(data) for leaves that no octree has, Error(usage) for
/// parameters that do not suit. adapters/octree.hpp takes an octomap::OcTree this way.
Map map_from_leaves(std::span<const OccupancyView::Leaf> leaves, const Parameters& parameters);

}  // namespace octosurf
