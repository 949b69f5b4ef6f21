#pragma once

#include "geometry/moments.hpp"
#include "sensing/reading_model.hpp"

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include <octosurf/surface.hpp>

namespace octosurf::detection {

/// Readings that are held to be one plane, as sums: what the criterion decides on. Sizes in metres.
struct Patch {
  Plane plane;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< what `moments` are about
  geometry::Moments moments;                         ///< weighted by 1/variance (ReadingModel::weight)
  double readings = 0;                               ///< voxels
  double hits = 0;                                   ///< scans that hit these voxels, as the octree tells
  double log_peaks = 0;                              ///< Σ ReadingModel::log_peak
  /// m², of what they have in common (ReadingModel::pose_variance).
  double pose_variance = sensing::ReadingModel::pose_sigma * sensing::ReadingModel::pose_sigma;

  Eigen::Vector3d centroid() const { return origin + moments.mean(); }
  /// Adds the other's sums; fits nothing.
  void add(const Patch& other);
  /// Adds the other's readings and fits the plane to all. The other may face elsewhere.
  void take(const Patch& other);
  /// The least-squares plane of the moments, on the side that `plane` faces.
  void fit();
  /// Σ weight · distance² of its readings to a plane.
  double chi2(const Plane& to) const;
  /// m, off the plane to where a reading of its mean variance and peak stops belonging to it.
  double reach() const { return std::sqrt(std::max(0.0, 2 * log_peaks / moments.count)); }
  /// Σ log_ratio of its readings to a plane, nats: positive if they belong to it on the whole.
  double explained_by(const Plane& other) const { return log_peaks - 0.5 * chi2(other); }
};

/// A patch as heights over a frame: offset + slopes · (u, v), and how sure they are. The covariance is that
/// of independent readings plus what they have in common, σ_pose² for the offset and σ_pose² over the
/// readings' extent² for the slopes: with W the sum of weights and N the normal matrix of the fit,
/// (1 + W σ_pose²) N⁻¹ is exactly that.
struct Heights {
  Eigen::Vector3d theta;       ///< offset [m], slopes along u and v
  Eigen::Matrix3d covariance;  ///< of these
};
/// `R`: rows u, v, normal of a frame at `at`.
Heights heights_over(const Patch& patch, const Eigen::Vector3d& at, const Eigen::Matrix3d& R);

/// Two patches, which may be of one plane. As readings of one, their heights differ by D with the sum C of
/// their covariances; how likely that is does not depend on where heights are taken: elsewhere D and C are
/// sheared, by a determinant of one.
class PlanePair {
 public:
  PlanePair(const Patch& a, const Patch& b);
  /// ln of how much more likely the two planes are as readings of one plane than of two that differ by
  /// something. Of that something not even the scale is known, between what can be told apart and a hundred
  /// times as much: a prior that is even in its logarithm. `at`: where they meet; there the step is taken.
  /// Cost: a logarithm.
  double log_same(const Eigen::Vector3d& at) const;

 private:
  Eigen::Matrix3d R_;  // rows u, v, normal of a frame between the two
  Eigen::Vector3d about_;
  Eigen::Vector3d D_;  // there
  Eigen::Matrix3d C_;
  double log_ratio_;  // but for the step's size, which follows the place
};
inline double log_same(const Patch& a, const Patch& b, const Eigen::Vector3d& at) {
  return PlanePair(a, b).log_same(at);
}

/// ln of how much shorter the readings are told without `b`, as the tail of `a`'s noise. Of the readings in
/// each of `a`'s voxels, some of those that reach a voxel beyond it are bound to lie off by more: the more
/// often `a` was hit than `b`, the less such a tail says.
double log_tail(const Patch& a, const Patch& b);

/// Nats that a plane must explain before it is worth telling: its parameters as exactly as its readings know
/// them (Laplace's approximation: the volume of all planes over that of those the readings allow), and how
/// many places were looked at for one.
double description_cost(const Patch& patch);

}  // namespace octosurf::detection
