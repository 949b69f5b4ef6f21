#pragma once

#include "alignment/near_surfaces.hpp"
#include "alignment/samples.hpp"
#include "geometry/moments.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <octosurf/alignment.hpp>

namespace octosurf::alignment {

/// Neighbouring readings of a scan.
struct ScanPatch {
  geometry::Moments moments;  ///< about the sensor
  double variance = 0;        ///< Σ of the readings' along the line of sight
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ(), centroid = Eigen::Vector3d::Zero();  ///< by fit_plane()
  Eigen::Vector3d reading = Eigen::Vector3d::Zero();  ///< the first of them
  bool on_plane = false;                              ///< on the plane that is being collected
  /// Whether they are enough, and flat within their noise.
  bool fit_plane();
};
/// Of cells 8 voxels wide, in the order of the scan's first reading in each. Some ten thousand readings.
std::vector<ScanPatch> patches_of(const Scan& scan, const sensing::NoiseModel& noise,
                                  const RangeLimits& limits, double resolution);

/// Normals of a scan's largest planes, sensor's frame, of parallel ones one.
std::vector<Eigen::Vector3d> directions_of(const Scan& scan, const sensing::NoiseModel& noise,
                                           const RangeLimits& limits, double resolution);

/// Candidate poses that match planes of a scan with surfaces, each from three planes in general position:
/// every combination of the scan's larger planes with candidate surfaces within reach, those with most
/// readings first, at most `most`. Along undetermined directions, the pose stays at `start`.
std::vector<Eigen::Isometry3d> poses_by_planes(const Scan& scan, const sensing::NoiseModel& noise,
                                               const RangeLimits& limits, double resolution,
                                               std::span<const AlignedSurface* const> surfaces,
                                               const Eigen::Isometry3d& start, const AlignmentReach& reach,
                                               std::size_t most);

}  // namespace octosurf::alignment
