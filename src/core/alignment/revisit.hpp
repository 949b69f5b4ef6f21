#pragma once

#include "alignment/pose_fit.hpp"
#include "alignment/seen_patches.hpp"
#include "alignment/sensor_error.hpp"

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::alignment {

/// Travel after which a patch counts as revisited, m: a rotation by 1 rad counts as a metre, the typical
/// distance of the surroundings. At 1 % of drift, it accumulates a centimetre, half a usual voxel.
inline constexpr double revisit_span_m = 1;

/// Voxels: intrinsic error of a patch, as its plane is slightly tilted and scans read different parts of it.
inline constexpr double map_error_voxels = 0.1;

/// A scan's readings of one patch.
struct PatchObservation {
  SeenPatches::Key key = 0;
  SeenPatch patch;      ///< before the scan
  double weight = 0;    ///< 1/m², from the readings' noise
  double distance = 0;  ///< m, off the patch's plane, mean
  Twist by_pose = Twist::Zero();
  SensorErrors by_error = SensorErrors::Zero();
};

/// The scan's readings on surfaces, grouped by patch, ascending keys. A patch is the part of one surface in a
/// column 16 voxels wide. Systematic errors are those of `sensor`: scans of another one do not measure them.
/// O(readings).
std::vector<PatchObservation> observe(const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                                      std::span<const MatchedReading> readings, const SeenPatches& patches,
                                      SensorKind sensor, double resolution);

/// Measurement of a scan's pose from patches seen long ago: motion + by_error · (sensor's error) =
/// measurement, in independent directions.
struct Revisit {
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 6, 6> directions;  ///< rows: measured directions of a twist
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> motion;      ///< along them, from the matched pose
  Eigen::Matrix<double, Eigen::Dynamic, sensor_error_size, 0, 6, sensor_error_size> by_error;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> variances;              ///< of each, from the patches
  SensorErrorCovariance error_information = SensorErrorCovariance::Zero();  ///< for any pose
  SensorErrors error_vector = SensorErrors::Zero();
  TwistCovariance all_directions = TwistCovariance::Identity();  ///< as Alignment::directions
  double lever_m = 1;
  double scatter_m = 0;     ///< of the patches, beyond their readings' noise
  std::size_t patches = 0;  ///< seen again
};

/// `errors`: current estimate of the sensor's, for the patches' weights. `patch_m`: usual scatter of patches.
Revisit measure(std::span<const PatchObservation> observations, double travelled_m,
                const SensorErrors& errors, double patch_m, double resolution);

/// Fills in Alignment: the directions that it measures.
void describe(const Revisit& revisit, Alignment& alignment);

}  // namespace octosurf::alignment
