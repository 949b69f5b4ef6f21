#pragma once

#include "surfaces/ledger.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace octosurf::mapper {

/// The surfaces that another map has on points which have appeared in this one.
struct ForeignSurfaces {
  const surfaces::SurfaceStore& store;  ///< the other map's
  Eigen::Isometry3d T_map_other;        ///< the other map's frame to this one's
  std::span<const SurfaceId> owner;     ///< of each point that appeared, in the other map; 0: pending there
};

/// Makes surfaces of those points that are still pending, as the other map has found them: its plane, its
/// inliers, and the evidence that its scans have left. The planes were fitted over all of its scans, so they
/// need not be found again among points that all come at once; whether they are surfaces here, and one with
/// those that were, later stages ask as of any other. Less than n points make none: they are left to
/// those stages. O(points).
void adopt_surfaces(surfaces::Ledger& ledger, std::span<const surfaces::MapView::Index> appeared,
                    const ForeignSurfaces& foreign);

}  // namespace octosurf::mapper
