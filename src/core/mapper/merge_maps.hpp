#pragma once

#include "surfaces/map_state.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <vector>

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

  /// Adds its records besides voxels and surfaces: number of scans, sensor up directions, unaligned scans and
  /// noise statistics.
  void hand_over_records(surfaces::MapState& map) const;

  /// The surfaces that have its surfaces' points after the merge.
  std::vector<MergedSurface> successors_in(const surfaces::MapState& map) const;

 private:
  const surfaces::MapState& other_;
  Eigen::Isometry3d T_map_other_;
  std::optional<occupancy::OccupancyMap> resampled_;
  std::size_t lost_ = 0;
};

}  // namespace octosurf::mapper
