#pragma once

#include "surfaces/ledger.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <span>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// Throws as Mapper::merge() documents, before any change.
void require_mergeable(const surfaces::MapState& map, const surfaces::MapState& other,
                       const Eigen::Isometry3d& T_map_other);

/// A map to be merged into another, in the other's frame. The map must outlive it.
class OtherMap {
 public:
  /// Resamples its octree unless the frames are equal. `parameters`: of the map that takes it in.
  OtherMap(const surfaces::MapState& other, const Eigen::Isometry3d& T_map_other,
           const OccupancyParameters& parameters);

  /// Its octree on this map's grid.
  const occupancy::OccupancyMap& occupancy() const { return resampled_ ? *resampled_ : other_.occupancy; }
  std::size_t points_lost() const { return lost_; }  ///< outside this map's octree

  /// Adds its records besides voxels and surfaces: number of scans, sensor up directions, noise statistics.
  void hand_over_records(surfaces::MapState& map) const;

 private:
  const surfaces::MapState& other_;
  Eigen::Isometry3d T_map_other_;
  std::optional<occupancy::OccupancyMap> resampled_;
  std::size_t lost_ = 0;
};

/// The other map's surfaces of points that appeared in this one.
struct ForeignSurfaces {
  const surfaces::SurfaceStore& store;  ///< the other map's
  Eigen::Isometry3d T_map_other;        ///< the other map's frame to this one's
  std::span<const SurfaceId> owner;     ///< of each point that appeared, in the other map; 0: pending there
};

/// Creates surfaces from the pending points as the other map segmented them: with its plane, its inliers and
/// its evidence. The planes were fitted over many scans, so they need not be detected again in points that
/// arrive all at once; later stages check and merge them like any other surface. Surfaces of fewer than n
/// points are left to those stages. O(points).
void adopt_surfaces(surfaces::Ledger& ledger, std::span<const occupancy::VoxelPoint> appeared,
                    const ForeignSurfaces& foreign);

}  // namespace octosurf::mapper
