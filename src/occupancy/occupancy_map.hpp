#pragma once

#include "geometry/voxel_grid.hpp"
#include "occupancy/voxel_payload.hpp"
#include "sensing/downsample.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <octosurf/adapters/detail/scan_rays.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::occupancy {

class RayBits;
class VoxelTree;

/// A voxel's point as it stands in the octree.
struct VoxelPoint {
  geometry::VoxelKey key;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f view = Eigen::Vector3f::UnitZ();  ///< unit, toward where it was seen from
  std::uint8_t range_class = 0;                     ///< payload.hpp
  SurfaceId surface = 0;                            ///< 0: pending
  PayloadPlace place{};  ///< where it is kept, if that is known; valid until the next insert
};

/// The octree's answer to a scan: what became occupied, what no longer is, and whose point a closer
/// view has replaced. Lists are in Morton order, whatever the order of the scan's points.
struct OccupancyDelta {
  struct Refined {
    VoxelPoint before, after;  ///< same key and surface
  };
  std::vector<VoxelPoint> appeared;  ///< pending, surface 0
  std::vector<VoxelPoint> vanished;  ///< as they were; no longer in the octree
  std::vector<Refined> refined;
  /// Hits in voxels that belong to a surface, whose point stays what it was.
  struct Confirmed {
    SurfaceId surface;
    std::uint32_t end;  ///< of the scan's ends
  };
  std::vector<Confirmed> confirmed;
};

/// Tells the plane of a surface; asked when a ray passed through one of its voxels.
class PlaneLookup {
 public:
  virtual ~PlaneLookup() = default;
  /// False if a miss in the surface's voxel always counts.
  virtual bool find(SurfaceId id, Plane& plane, double& tolerance) const = 0;
};

/// The octree that owns the points (docs/design.md §3), equal to OctoMap's voxel by voxel.
///
/// 1. With no `planes`, the tree equals octomap::OcTree::insertPointCloud(cloud, origin, max_range,
///    false, true), voxel by voxel and value by value.
/// 2. Every occupied voxel that a scan made so keeps one point, one view, one surface id.
/// 3. With `planes`, a miss in a surface's voxel counts only if some ray through that voxel crosses
///    the surface's plane and ends beyond its tolerance.
class OccupancyMap {
 public:
  explicit OccupancyMap(const OccupancyParameters& parameters);
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;
  ~OccupancyMap();

  const geometry::VoxelGrid& grid() const { return grid_; }

  /// `index` finds the end voxels of `scan` by key. `threads` share the rays; they change nothing in
  /// the result. Cost: about 1 ns a ray step and 2 ns a voxel that is not free for good.
  OccupancyDelta insert(const sensing::VoxelScan& scan, const sensing::Downsampler& index,
                        const PlaneLookup* planes, int threads = 1);

  /// Its first half, which takes most of the memory, changes nothing: what the rays touch, valid until the
  /// next call. The second half takes that in.
  using Touched = std::span<const detail::TouchedBlock>;
  Touched trace(const sensing::VoxelScan& scan, int threads = 1);
  OccupancyDelta apply(const Touched& touched, const sensing::VoxelScan& scan,
                       const sensing::Downsampler& index, const PlaneLookup* planes);

  /// What another octree has brought in.
  struct Merged {
    OccupancyDelta delta;             ///< appeared, vanished and refined, as by a scan
    std::vector<SurfaceId> surfaces;  ///< whose each of delta.appeared is in the other octree; 0: pending
  };
  /// Takes in what another octree on the same grid and with the same model knows, as independent readings.
  /// Their log-odds add up (Bayes' rule; before any reading they are 0) and are clamped as OctoMap clamps
  /// them reading by reading, so that what changes can be unlearned; a voxel that only one knows has its
  /// value. Occupancy is the same whichever takes in the other. A voxel that has a point keeps it unless the
  /// other was seen from nearer by; one that becomes occupied, or had none, takes the other's. Where neither
  /// has one, the sum of two doubts being enough, the next reading brings it. `other` must not be this one.
  /// O(nodes), some 5 ns a voxel of divided cubes.
  Merged merge(const OccupancyMap& other);
  /// What an octree knows, on the grid of another frame. Its points are moved, with the log-odds of their
  /// voxel; of several that meet in one voxel the one seen from nearest stays, the first in Morton order of
  /// as near ones, and the highest log-odds. All other voxels have the log-odds at their centre, where that
  /// is not a point's voxel. Points outside the grid are counted in `lost`. O(nodes near what is known), some
  /// 0.5 µs a voxel that is not deep in a cube of one value.
  static OccupancyMap resampled(const OccupancyMap& other, const Eigen::Isometry3d& T_here_other,
                                const OccupancyParameters& parameters, std::size_t& lost);
  bool empty() const;  ///< knows nothing

  /// Gives a point to occupied voxels one of whose six neighbours is open (OpenSpace), seen from there, or to
  /// the middle of the up to 6 that lie behind them, and none to those that have one there. For maps that
  /// come without points. Undivided occupied leaves are
  /// divided at such a border. Throws Error(data), before anything is changed, if their skins have over 2¹⁷
  /// voxels and one for 32 bytes of octree, which no scans leave.
  std::vector<VoxelPoint> adopt_occupied_voxels();

  enum class State { unknown, free, occupied };
  struct Lookup {
    State state = State::unknown;
    float log_odds = 0;
    std::optional<VoxelPoint> point;
  };
  Lookup at(geometry::VoxelKey key) const;

  void assign(const VoxelPoint& point, SurfaceId surface);  ///< faster if it has its `place`
  void assign(geometry::VoxelKey key, SurfaceId surface);   ///< no-op without a point

  /// The octree as it is now, for readers in any thread.
  OccupancyView share();

  /// From here on until commit() or roll_back() the octree as it is now is kept, at the cost of a copy of
  /// what is written to. Not while a begin_changes() is open already.
  void begin_changes();
  void commit() noexcept;
  void roll_back() noexcept;

  /// Appends the points of the 8³ block that holds `key`, in Morton order.
  void read_block(geometry::VoxelKey key, std::vector<VoxelPoint>& out) const;
  /// All points, in Morton order.
  void for_each_point(const std::function<void(const VoxelPoint&)>& visit) const;

  struct Size {
    std::size_t nodes = 0, leaves = 0;  ///< of the same tree in OctoMap
    std::size_t bytes = 0;              ///< of ours, without reserves
  };
  Size size() const;
  std::size_t bytes() const;  ///< size().bytes, in O(1)

  /// Throws Error(data) for leaves that no octree has.
  void set_leaves(std::span<const OccupancyView::Leaf> leaves);

  // Files. OctoMap's readers trust what they read, so hostile input is checked here first.
  void write_bt(std::ostream& out) const;  ///< plain OctoMap, maximum likelihood, pruned
  /// Preorder: per node its child mask, log-odds and payload; lossless. `sink` gets chunks.
  void write_nodes(const std::function<void(const std::string&)>& sink) const;
  /// Inverse; `source` returns the next chunk (empty: none). Throws Error(data).
  void read_nodes(const std::function<std::string()>& source, const std::string& where);
  /// Reads a .bt or .ot, its own resolution; Error(data), also over 32 MiB + 64 times the file's size.
  static OccupancyMap read_octomap(const std::filesystem::path& file, OccupancyParameters parameters);

 private:
  struct Policy;
  geometry::VoxelGrid grid_;
  std::unique_ptr<VoxelTree> tree_;
  std::unique_ptr<RayBits> bits_;
};

}  // namespace octosurf::occupancy
