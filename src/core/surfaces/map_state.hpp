#pragma once

#include "occupancy/occupancy_map.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/cylinder_store.hpp"
#include "surfaces/published.hpp"
#include "surfaces/surface_store.hpp"

#include <memory>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::alignment {
struct AlignmentRecord;
}  // namespace octosurf::alignment

namespace octosurf::surfaces {

/// Pending points added since the last detection around them, and the order of further detection.
struct PendingQueue {
  std::vector<geometry::VoxelKey> fresh;   ///< key order; some may no longer be pending
  std::vector<geometry::VoxelKey> blocks;  ///< oldest first: one voxel of each waiting block

  bool operator==(const PendingQueue&) const = default;
};

/// The whole state of a map: the contents of a .surfaces file, and the working data of a Mapper. Everything
/// that affects the next scan is here and is saved, so that resuming changes nothing.
struct MapState {
  explicit MapState(const Parameters& p)
      : parameters(p),
        occupancy(p.occupancy),
        surfaces(p.occupancy.resolution),
        noise(p),
        snapshot(std::make_shared<Snapshot>(Snapshot{0, p.occupancy.resolution, {}})) {
    surfaces.set_erosion_tolerance(p.surface_tolerance());
  }

  Parameters parameters;
  occupancy::OccupancyMap occupancy;
  SurfaceStore surfaces;
  CylinderStore cylinders;
  sensing::NoiseModel noise;
  std::shared_ptr<alignment::AlignmentRecord> alignment;  ///< alignment::record_of()
  RemovalLog removals;
  PendingQueue queue;
  std::size_t points = 0;  ///< voxels with a point
  std::uint64_t scans = 0;
  std::vector<std::uint64_t> held;  ///< fingerprints of the last remembered scans, 10⁵ or more, oldest first
  std::uint64_t revision = 0;
  /// Sum over the scans of their sensor's up direction, unit vectors in the map frame: for up_of().
  Eigen::Vector3d sensors_up = Eigen::Vector3d::Zero();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< Map::origin()
  Published snapshot;                                ///< the state that readers in other threads see
  /// What io knows of the file with this map (io/map_file/map_file.hpp).
  mutable std::shared_ptr<void> saved;
  bool octree_shared = false;  ///< snapshots include it; a setting of the process

  /// A change failed, and its rollback is incomplete for lack of memory (mapper::MapChange).
  bool unrestored = false;
  void restore();              ///< completes the rollback; throws std::bad_alloc
  void require_whole() const;  ///< throws Error(incomplete) if the rollback is incomplete
};

MapState& state_of(Map& map);              ///< restored; throws std::bad_alloc
const MapState& state_of(const Map& map);  ///< throws Error(incomplete) if the rollback is incomplete
Map map_of(std::unique_ptr<MapState> state);

}  // namespace octosurf::surfaces
