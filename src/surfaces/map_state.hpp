#pragma once

#include "occupancy/occupancy_map.hpp"
#include "sensing/noise_model.hpp"
#include "surfaces/alignment_state.hpp"
#include "surfaces/atomic_shared_ptr.hpp"
#include "surfaces/cylinder_store.hpp"
#include "surfaces/pending_queue.hpp"
#include "surfaces/seen_patches.hpp"
#include "surfaces/surface_store.hpp"

#include <memory>
#include <vector>

#include <octosurf/map.hpp>

namespace octosurf::surfaces {

/// Everything a map is: what a .surfaces file holds and a Mapper works on. Whatever decides what
/// the next scan does stands here and is saved, so that stopping and going on changes nothing.
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
  AlignmentState alignment;
  SeenPatches patches;
  DepartureLog departures;
  PendingQueue queue;
  std::size_t points = 0;  ///< voxels that hold one
  std::uint64_t scans = 0;
  std::vector<std::uint64_t> held;  ///< fingerprints of those that are remembered, as they came
  std::uint64_t revision = 0;
  /// Sum over the scans of their sensor's own up direction, unit vectors in the map frame: what up_of() asks.
  Eigen::Vector3d sensors_up = Eigen::Vector3d::Zero();
  AtomicSharedPtr<const Snapshot> snapshot;  ///< what readers in other threads see
  bool octree_shared = false;                ///< its octree, too; a wish of the process, not of the map

  /// Changes have failed and the surfaces are not yet as they were before, for want of memory (Transaction).
  bool unrestored = false;
  void restore();              ///< makes them so; throws std::bad_alloc
  void require_whole() const;  ///< throws Error(incomplete) if they are not
};

}  // namespace octosurf::surfaces
