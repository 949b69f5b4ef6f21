#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

struct MapState;

/// What a scan source, the octree and the surfaces amount to at one moment: the persistent thing.
/// Move-only. A Mapper takes one over to go on with it. After a scan that failed half-way (mapper.hpp, 4),
/// everything but parameters() and snapshot() throws Error(incomplete).
class Map {
 public:
  explicit Map(const Parameters& parameters = {});  ///< an empty map; validates the parameters
  explicit Map(std::unique_ptr<MapState> state);    ///< used by readers of map files
  Map(Map&&) noexcept;
  Map& operator=(Map&&) noexcept;
  ~Map();

  const Parameters& parameters() const;
  std::shared_ptr<const Snapshot> snapshot() const;

  enum class Occupancy { unknown, free, occupied };
  struct Voxel {
    Occupancy occupancy = Occupancy::unknown;
    float log_odds = 0;
    SurfaceId surface = 0;                 ///< 0: pending, or not occupied
    std::optional<Eigen::Vector3d> point;  ///< representative point, map frame
    std::optional<Eigen::Vector3d> view;   ///< unit vector toward where it was seen from
  };
  /// The voxel that holds `point` (map frame); unknown outside the octree's range. O(depth).
  Voxel at(const Eigen::Vector3d& point) const;

  /// The octree as it is now, to be read from any thread while the map goes on; not while something inserts.
  /// A Mapper that is told to share_octree() has one in each snapshot().
  OccupancyView octree() const;

  /// Calls `visit` for every occupied voxel's point, in key order. O(nodes).
  void for_each_point(const std::function<void(const Voxel&)>& visit) const;

  struct Size {
    std::size_t nodes = 0, leaves = 0, bytes = 0;
    std::size_t points = 0, pending = 0, surfaces = 0, inliers = 0;
    std::uint64_t scans = 0, revision = 0;
  };
  Size size() const;

  const MapState& state() const;
  MapState& state();

 private:
  std::unique_ptr<MapState> state_;
};

/// Where the scans that a map was built from are kept (`octosurf map --keep-scans`), so that it can be built
/// anew with corrected poses.
struct KeptScans {
  std::filesystem::path folder;  ///< of the archive that holds all of them; empty: they are not kept
  bool shared = false;           ///< with another map, which may go on with it, as this one may not
  /// Of the first scans, where the map was built with others than the archive says.
  std::vector<Eigen::Isometry3d> poses{};
};

/// Writes `stem`.surfaces (everything) and `stem`.bt (plain OctoMap), each to a temporary file that is synced
/// and renamed: whenever that fails or the process dies, the files of before or the new ones are there.
/// Throws Error(output), and Error(incomplete) for a map that is not whole. The file remembers where the
/// map's `scans` are, relative to it where that can be said; by default that they are not kept.
void save_map(const Map& map, const std::filesystem::path& stem, const KeptScans& scans = {});

struct LoadedMap {
  Map map;
  std::string warning;  ///< empty, or e.g. that the .bt does not match
  KeptScans scans{};
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
