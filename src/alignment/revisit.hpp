#pragma once

#include "alignment/pose_fit.hpp"
#include "alignment/sensor_error.hpp"
#include "surfaces/seen_patches.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// How long ago a patch was seen counts by the way, m: a rotation by 1 rad counts as a metre, the distance at
/// which most of what a robot sees is. At 1 % of drift a centimetre, half a usual voxel, has come together.
inline constexpr double revisit_span_m = 1;

/// Voxels: what a patch is off by itself, because its plane leans a little and scans read other parts of it.
inline constexpr double map_error_voxels = 0.1;

/// A scan's readings of one patch.
struct PatchLook {
  surfaces::SeenPatches::Key key = 0;
  surfaces::Patch patch;  ///< as it was before the scan
  double weight = 0;      ///< 1/m², by the readings' noise
  double distance = 0;    ///< m, off the patch's plane, mean
  Twist by_pose = Twist::Zero();
  SensorErrors by_error = SensorErrors::Zero();
};

/// The scan's readings that lie on surfaces, by patch, ascending keys. A patch is what of one surface lies in
/// a column 16 voxels wide. The errors are those of `sensor`: another's scan measures none of them.
/// O(readings).
std::vector<PatchLook> looks_at(const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                                std::span<const Laid> readings, const surfaces::SeenPatches& patches,
                                SensorKind sensor, double resolution);

/// A scan's pose measured by patches that were seen long ago: motion + by_error · (sensor's error) is as
/// measured, in directions that are independent of each other.
struct Revisit {
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6> directions;  ///< rows: what is measured of a twist
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> motion;      ///< along them, from the pose laid at
  Eigen::Matrix<double, Eigen::Dynamic, sensor_error_size, 0, 6, sensor_error_size> by_error;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> variances;              ///< of each, by the patches
  SensorErrorCovariance error_information = SensorErrorCovariance::Zero();  ///< whatever the pose is
  SensorErrors error_vector = SensorErrors::Zero();
  TwistCovariance all_directions = TwistCovariance::Identity();  ///< as Alignment::directions
  double lever_m = 1;
  double scatter_m = 0;     ///< of the patches, beyond their readings' noise
  std::size_t patches = 0;  ///< seen again
};

/// `errors`: the sensor's as estimated so far, to weigh patches by. `patch_m`: what a patch usually scatters
/// by.
Revisit measure(std::span<const PatchLook> looks, double way_m, const SensorErrors& errors, double patch_m,
                double resolution);

/// Fills in Alignment: the disagreement from the pose laid at, without the sensor's errors.
void describe(const Revisit& revisit, const SensorErrors& errors, Alignment& alignment);

}  // namespace octosurf::alignment
