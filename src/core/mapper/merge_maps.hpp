#pragma once

#include "surfaces/ledger.hpp"

#include <Eigen/Geometry>

#include <octosurf/mapper.hpp>

namespace octosurf::mapper {

/// Throws as Mapper::merge() documents, before any change.
void require_mergeable(const surfaces::MapState& map, const surfaces::MapState& other,
                       const Eigen::Isometry3d& T_map_other);

/// Adds the other map's records besides voxels and surfaces: number of scans, sensor up directions, noise
/// statistics.
void add_records(surfaces::MapState& map, const surfaces::MapState& other,
                 const Eigen::Isometry3d& T_map_other);

/// Creates surfaces from the pending points as the other map segmented them: with its plane, its inliers and
/// its evidence. The planes were fitted over many scans, so they need not be detected again in points that
/// arrive all at once; later stages check and merge them like any other surface. Surfaces of fewer than n
/// points are left to those stages. O(points).
void adopt_surfaces(surfaces::Ledger& ledger, const occupancy::OccupancyMap::Merged& merged,
                    const surfaces::SurfaceStore& others, const Eigen::Isometry3d& T_map_other);

}  // namespace octosurf::mapper
