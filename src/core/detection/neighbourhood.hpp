#pragma once

#include "detection/segmentation.hpp"
#include "surfaces/ledger.hpp"

#include <array>
#include <map>
#include <span>

namespace octosurf::detection {

/// The cells to label: `points`, cells, and all of `surfaces`. Pending cells within h of these are
/// candidates; context are cells of inliers beside all that, on the last part of its rays, and at boundaries
/// within h. Cost is proportional to the input.
Neighbourhood neighbourhood_of(const surfaces::MapView& map, std::span<const PointId> points,
                               std::span<const SurfaceId> surfaces = {});

/// How a surface's inliers were seen: sums over some of them, for the weights of the others.
struct SurfaceSeen {
  struct Views {
    double count = 0, cos_incidence = 0;  ///< cells
  };
  Views all;
  std::array<Views, sensing::NoiseModel::classes> classes;  ///< by range class
  double voxels = 0, hits = 0;

  void add(const SurfaceSeen& other);
};
std::map<SurfaceId, SurfaceSeen> seen_among(const Readings& readings, const surfaces::SurfaceStore& surfaces);

/// The initial segmentation of readings: the labels of their surfaces, except those of `forgotten`, and the
/// sums of these surfaces' other inliers, including context. Inliers outside are weighted like those `seen`
/// of their range class, with equal hit counts. All inliers of `forgotten` must be among the readings, none
/// as context.
Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                         const std::map<SurfaceId, SurfaceSeen>& seen, std::span<const SurfaceId> forgotten);

/// The same with what is seen among the readings.
inline Segmentation known_about(const Readings& readings, const surfaces::SurfaceStore& surfaces,
                                std::span<const SurfaceId> forgotten) {
  return known_about(readings, surfaces, seen_among(readings, surfaces), forgotten);
}

}  // namespace octosurf::detection
