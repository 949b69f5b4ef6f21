#pragma once

#include "surfaces/ledger.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace octosurf::mapper {

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
