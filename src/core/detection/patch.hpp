#pragma once

#include "geometry/moments.hpp"
#include "sensing/reading_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include <octosurf/surface.hpp>

namespace octosurf::detection {

/// Sums over readings assumed to lie on one plane: the input of the criterion. Sizes in metres.
struct Patch {
  Plane plane;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< reference of `moments`
  geometry::Moments moments;                         ///< weighted by 1/variance (ReadingModel::weight)
  double readings = 0;                               ///< voxels
  double hits = 0;                                   ///< scans that hit these voxels, by log-odds
  double log_peaks = 0;                              ///< Σ ReadingModel::log_peak
  /// m², of their common error (ReadingModel::pose_variance).
  double pose_variance = sensing::ReadingModel::pose_sigma * sensing::ReadingModel::pose_sigma;

  Eigen::Vector3d centroid() const { return origin + moments.mean(); }
  /// Adds the other's sums; fits nothing.
  void add(const Patch& other);
  /// Adds the other's readings and fits the plane to all. The other may face another way.
  void take(const Patch& other);
  /// Fits the least-squares plane of the moments, facing the side of `plane`.
  void fit();
  /// Σ weight · distance² of its readings to a plane.
  double chi2(const Plane& to) const;
  /// m, distance from the plane at which a reading of mean variance and peak no longer belongs to it.
  double reach() const { return std::sqrt(std::max(0.0, 2 * log_peaks / moments.count)); }
  /// Σ log_ratio of its readings to a plane, nats: positive if they belong to it overall.
  double explained_by(const Plane& other) const { return log_peaks - 0.5 * chi2(other); }
};

/// A patch as heights over a frame: offset + slopes · (u, v), with covariance. The covariance is that of
/// independent readings plus their common error, σ_pose² for the offset and σ_pose² over the readings'
/// extent² for the slopes: with W the sum of weights and N the normal matrix of the fit, this is exactly (1 +
/// W σ_pose²) N⁻¹.
struct Heights {
  Eigen::Vector3d theta;       ///< offset [m], slopes along u and v
  Eigen::Matrix3d covariance;  ///< of these
};
/// `R`: rows u, v, normal of a frame at `at`.
Heights heights_over(const Patch& patch, const Eigen::Vector3d& at, const Eigen::Matrix3d& R);

/// Two patches that may be of one plane. Under that hypothesis the difference D of their heights has
/// covariance C, the sum of theirs; its likelihood is independent of the reference point: elsewhere D and C
/// are sheared with determinant one.
class PlanePair {
 public:
  PlanePair(const Patch& a, const Patch& b);
  /// ln of the odds that the two planes are one rather than two that differ. The scale of a difference is
  /// unknown, between the smallest detectable one and a hundred times that: a log-uniform prior. `at`: the
  /// contact, where the step is evaluated. Cost: a logarithm.
  double log_same(const Eigen::Vector3d& at) const;

 private:
  Eigen::Matrix3d R_;  // rows u, v, normal of a frame between the two
  Eigen::Vector3d about_;
  Eigen::Vector3d D_;  // at that frame
  Eigen::Matrix3d C_;
  double log_ratio_;  // without the step's size, which depends on the place
};
inline double log_same(const Patch& a, const Patch& b, const Eigen::Vector3d& at) {
  return PlanePair(a, b).log_same(at);
}

/// ln of the description length saved by treating `b` as the tail of `a`'s noise. In each of `a`'s voxels,
/// some readings that reach the next voxel are bound to be far off: the more often `a` was hit than `b`, the
/// less evidence such a tail is.
double log_tail(const Patch& a, const Patch& b);

/// Nats that a plane must explain to be accepted: its parameters at the precision that its readings determine
/// (Laplace's approximation: the prior volume of planes over the posterior's), and the number of places
/// searched.
double description_cost(const Patch& patch);

}  // namespace octosurf::detection
