#pragma once

#include "surfaces/map_state.hpp"

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// Throws as Mapper::merge() says, before anything is touched.
void require_mergeable(const surfaces::MapState& map, const surfaces::MapState& other,
                       const Eigen::Isometry3d& T_map_other);

/// A map that is being merged into another, as seen from there. The map must outlive it.
class OtherMap {
 public:
  /// Resamples its octree unless the frames are one. `parameters`: of the map that it is merged into.
  OtherMap(const surfaces::MapState& other, const Eigen::Isometry3d& T_map_other,
           const OccupancyParameters& parameters);

  /// Its octree on this map's grid.
  const occupancy::OccupancyMap& occupancy() const { return resampled_ ? *resampled_ : other_.occupancy; }
  std::size_t points_lost() const { return lost_; }  ///< outside this map's octree

  /// What is no voxel and no surface: how many scans, where up was to their sensors, which did not fit, and
  /// what they told of the noise.
  void hand_over_records(surfaces::MapState& map) const;

  /// Where its surfaces' points are now that it is merged.
  std::vector<MergedSurface> heirs_in(const surfaces::MapState& map) const;

 private:
  const surfaces::MapState& other_;
  Eigen::Isometry3d T_map_other_;
  std::optional<occupancy::OccupancyMap> resampled_;
  std::size_t lost_ = 0;
};

}  // namespace octosurf::mapper
