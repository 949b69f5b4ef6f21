#pragma once

#include "geometry/moments.hpp"
#include "geometry/plane_covariance.hpp"
#include "geometry/plane_frame.hpp"
#include "sensing/noise_model.hpp"

#include <Eigen/Geometry>
#include <array>

#include <octosurf/surface.hpp>

namespace octosurf::surfaces {

/// A surface's plane and frame, and the sums over its readings from which they are estimated.
///
/// Moments are the sums over exactly the inliers (up to rounding).
class PlaneEstimate {
 public:
  /// Repeated observations of the inliers' voxels, besides the point stored in each voxel. They make the
  /// plane more exact, because a voxel that noise reached only once has little weight in these sums.
  struct Evidence {
    geometry::Moments moments;  ///< about reference(), weighted like an inlier of the nearest class
    double readings = 0;        ///< number of voxel observations added
  };
  struct State {
    Plane plane;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< z along the normal, origin on the plane
    Eigen::Vector3d reference = Eigen::Vector3d::Zero();     ///< of the moments
    std::array<geometry::Moments, sensing::NoiseModel::classes> moments;  ///< of inliers, by range class
    Evidence evidence;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };

  PlaneEstimate(const Plane& plane, const Eigen::Vector3d& reference);
  explicit PlaneEstimate(const State& state);

  const Plane& plane() const { return state_.plane; }
  const Eigen::Isometry3d& pose() const { return state_.pose; }
  const Eigen::Vector3d& reference() const { return state_.reference; }
  double distance(const Eigen::Vector3f& p) const { return plane().signed_distance(p.cast<double>()); }
  /// Number of inliers.
  std::size_t size() const { return size_; }

  /// The pose follows by the smallest rotation from the old normal to the new one, with its origin projected
  /// onto the plane.
  void set_plane(const Plane& plane);

  /// Adds the mean of a scan's points in an inlier's voxel. Older readings fade once there are more than a
  /// hundred for each inlier, or when inliers are removed.
  void observe(const Eigen::Vector3f& position, double weight);
  const Evidence& evidence() const { return state_.evidence; }
  void forget_evidence() { state_.evidence = {}; }
  /// Adds the evidence of a surface that merges into this one.
  void take_evidence(const PlaneEstimate& other);

  /// Moments over all inliers, weighted by 1/measured_sigma² relative to the nearest class's σ, with the
  /// evidence, about reference(); over the inliers alone, unweighted, if `noise` is null.
  geometry::Moments moments(const sensing::NoiseModel* noise) const;
  /// Over the inliers of one range class, unweighted.
  const geometry::Moments& moments_of_class(unsigned range_class) const {
    return state_.moments[range_class];
  }
  /// Number of readings in moments(noise).
  double readings() const { return static_cast<double>(size_) + state_.evidence.readings; }
  double rms() const;
  /// The plane that fits all readings best: total least squares over moments(&noise), facing as the current
  /// one.
  Plane estimate(const sensing::NoiseModel& noise) const;

  /// Updates the covariance to moments(&noise) and pose, see Surface::covariance. O(1).
  void derive_covariance(const sensing::NoiseModel& noise);
  /// As last derived; zero before.
  const Eigen::Matrix3d& covariance() const { return state_.covariance; }
  /// The same without the disagreement of repeated observations. That has two causes that cannot be
  /// separated: inliers that lie too deep, and pose drift. Alignment must not attribute drift to the plane,
  /// or it would correct less the more the poses drift; the first cause, a tenth of a millimetre, is well
  /// below the common error of a scan's readings. O(1).
  Eigen::Matrix3d covariance_of_readings(const sensing::NoiseModel& noise) const;

 protected:
  void add(const Eigen::Vector3f& position, unsigned range_class);
  void remove(const Eigen::Vector3f& position, unsigned range_class);
  const State& estimate_state() const { return state_; }

 private:
  void fade(double share);
  std::array<geometry::ReadingGroup, 2> reading_groups(const sensing::NoiseModel& noise) const;

  State state_;
  std::size_t size_ = 0;
};

}  // namespace octosurf::surfaces
