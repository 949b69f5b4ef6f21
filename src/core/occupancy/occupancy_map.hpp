#pragma once

#include "geometry/voxel_grid.hpp"
#include "occupancy/voxel_payload.hpp"
#include "sensing/downsample.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <octosurf/occupancy.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {
struct SpacePart;
}  // namespace octosurf

namespace octosurf::occupancy {

struct TouchedVoxels;
class VoxelTree;

/// A voxel's point as stored in the octree.
struct VoxelPoint {
  geometry::VoxelKey key;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f view = Eigen::Vector3f::UnitZ();  ///< unit, toward the sensor
  std::uint8_t range_class = 0;                     ///< payload.hpp
  SurfaceId surface = 0;                            ///< 0: pending
  float log_odds = 0;                               ///< if read by block
  PayloadPlace place{};                             ///< its storage, if known; valid until the next insert
};

/// Changes of the octree by a scan: voxels that became occupied, voxels that no longer are, and points
/// replaced by a closer view. Lists are in Morton order, whatever the order of the scan's points.
struct OccupancyDelta {
  struct Refined {
    VoxelPoint before, after;  ///< same key and surface
  };
  std::vector<VoxelPoint> appeared{};  ///< pending, surface 0
  std::vector<VoxelPoint> vanished{};  ///< their former points
  std::vector<Refined> refined{};
  /// Hits in voxels that belong to a surface and keep their point.
  struct Confirmed {
    SurfaceId surface;
    std::uint32_t end;  ///< index into the scan's ends
  };
  std::vector<Confirmed> confirmed{};
};

/// Finds the plane of a surface; called when a ray passed through one of its voxels.
class PlaneLookup {
 public:
  virtual ~PlaneLookup() = default;
  /// False if a miss in the surface's voxel always counts.
  virtual bool find(SurfaceId id, Plane& plane, double& tolerance) const = 0;
};

/// The octree that owns the points (docs/design.md §3), equal to OctoMap's voxel by voxel.
///
/// 1. With no `planes`, the tree equals octomap::OcTree::insertPointCloud(cloud, origin, max_range, false,
///    true), voxel by voxel and value by value.
/// 2. Every voxel that a scan made occupied keeps one point, one view, one surface id.
/// 3. With `planes`, a miss in a surface's voxel counts only if some ray through that voxel crosses the
///    surface's plane and ends beyond its tolerance.
class OccupancyMap {
 public:
  explicit OccupancyMap(const OccupancyParameters& parameters);
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;
  ~OccupancyMap();

  const geometry::VoxelGrid& grid() const { return grid_; }

  /// `touched`: of this scan, by a RayTracer. Cost: about 2 ns a voxel that is not saturated free.
  OccupancyDelta apply(const TouchedVoxels& touched, const sensing::VoxelScan& scan,
                       const PlaneLookup* planes);
  /// Traces and applies a scan; `index` is RayTracer's.
  OccupancyDelta insert(const sensing::VoxelScan& scan, const sensing::Downsampler& index,
                        const PlaneLookup* planes, int threads = 1);

  /// Result of a merge.
  struct Merged {
    OccupancyDelta delta;             ///< appeared, vanished and refined, as by a scan
    std::vector<SurfaceId> surfaces;  ///< surface in the other octree of each of delta.appeared; 0: pending
  };
  /// Merges another octree on the same grid and with the same model, as independent readings. Log-odds add up
  /// (Bayes' rule; the prior is 0) and are clamped as OctoMap clamps each reading, so that changes remain
  /// possible; a voxel known in one only keeps its value. Occupancy does not depend on which one takes in the
  /// other. A voxel keeps its point unless the other's was seen from nearer; one that becomes occupied, or
  /// had none, takes the other's. If neither has one (both were below the threshold), the next reading adds
  /// it. `other` must not be this one. O(nodes), some 5 ns a voxel of divided cubes.
  Merged merge(const OccupancyMap& other);
  /// Resamples an octree onto the grid of another frame. Points are moved, with the log-odds of their voxel;
  /// of several in one voxel the one seen from nearest stays, on a tie the first in Morton order, with the
  /// highest log-odds. All other voxels have the log-odds at their centre, unless that is in a point's voxel.
  /// Points outside the grid are counted in `lost`. O(nodes near known space), some 0.5 µs a voxel that is
  /// not deep in a uniform cube.
  static OccupancyMap resampled(const OccupancyMap& other, const Eigen::Isometry3d& T_here_other,
                                const OccupancyParameters& parameters, std::size_t& lost);
  /// Sets voxels whose middle lies in a region to unknown, or as after one miss.
  OccupancyDelta clear(const SpacePart& part, bool as_free);
  /// Sets every voxel to unknown, free or occupied as in `other`, on the same grid, without its points.
  /// Log-odds are the other's, clamped, except saturated ones, as all of a .bt, that agree with the voxel
  /// here. Points stay where both are occupied; for the rest adopt_occupied_voxels() makes some, and throws.
  OccupancyDelta replace(const OccupancyMap& other);
  bool empty() const;  ///< everything is unknown

  /// Creates points in occupied voxels with an open neighbour of the six (OpenSpace), seen from there, or in
  /// the middle of the up to 6 along that direction, unless one of those has a point. For maps without
  /// points. Undivided occupied leaves are divided at such a border. Throws Error(data), before any change,
  /// if their surfaces have over 2¹⁷ voxels and one for 32 bytes of octree, more than any scans produce.
  std::vector<VoxelPoint> adopt_occupied_voxels();

  enum class State { unknown, free, occupied };
  struct Lookup {
    State state = State::unknown;
    float log_odds = 0;
    std::optional<VoxelPoint> point;
  };
  Lookup at(geometry::VoxelKey key) const;
  Lookup at(const Eigen::Vector3d& point) const;  ///< unknown outside

  /// Before voxels are assigned to a surface, after none is. No other surface here may have the same number
  /// (SurfaceNumbers).
  void add_surface(SurfaceId id);
  void remove_surface(SurfaceId id);
  void assign(const VoxelPoint& point, SurfaceId surface);  ///< faster with its `place`
  void assign(geometry::VoxelKey key, SurfaceId surface);   ///< no-op without a point

  /// The current octree, for readers in any thread.
  OccupancyView share();
  /// The same until the next change, and not for longer.
  OccupancyView now() const;

  /// Starts recording the previous state until commit() or roll_back(), at the cost of a copy of the chunks
  /// written to. Not nested.
  void begin_changes();
  void commit() noexcept;
  void roll_back() noexcept;

  /// Appends the points of the 8³ block that holds `key`, in Morton order.
  void read_block(geometry::VoxelKey key, std::vector<VoxelPoint>& out) const;
  /// All points, in Morton order.
  void for_each_point(const std::function<void(const VoxelPoint&)>& visit) const;

  struct Size {
    std::size_t nodes = 0, leaves = 0;  ///< some more than in OctoMap: cubes with points stay divided
    std::size_t bytes = 0;              ///< without reserves
  };
  Size size() const;
  std::size_t bytes() const;  ///< size().bytes, in O(1)

  /// Throws Error(data) for invalid leaves.
  void set_leaves(std::span<const OccupancyView::Leaf> leaves);

  // Files. OctoMap's readers do not validate their input, so it is checked here first.
  /// Adds a part that for_each_part() has given. Throws Error(data).
  void read_part(std::uint64_t path, std::string nodes, const std::string& where);
  /// Reads a .bt or .ot, its own resolution; Error(data), also over 32 MiB + 64 times the file's size.
  static OccupancyMap read_octomap(const std::filesystem::path& file, OccupancyParameters parameters);

 private:
  struct Policy;
  geometry::VoxelGrid grid_;
  std::unique_ptr<VoxelTree> tree_;
};

/// A plain OctoMap .bt: maximum likelihood, pruned.
void write_bt(const OccupancyView& view, std::ostream& out);

/// Edge of an octree's parts in map files, as a power of two. The larger, the fewer bytes all of them take,
/// and the more are written after one scan.
inline constexpr int part_level = 5;

/// Calls `visit(path, nodes)` for the octree's cubes of 2^part_level voxels and for the undivided ones above,
/// in Morton order. The path is a 1, then three bits for each level from the root on: which child. `nodes`,
/// without loss, are empty if the part is as when the octree had been shared `since` times.
void for_each_part(const OccupancyView& view, std::optional<std::uint32_t> since,
                   const std::function<void(std::uint64_t path, const std::string& nodes)>& visit);

}  // namespace octosurf::occupancy
