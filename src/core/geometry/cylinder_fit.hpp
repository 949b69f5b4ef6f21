#pragma once

#include <Eigen/Core>
#include <span>

namespace octosurf::geometry {

/// An unbounded cylinder; map frame.
struct CylinderShape {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis, near the fitted points
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit
  double radius = 0;                                ///< m

  double height(const Eigen::Vector3d& p) const { return axis.dot(p - point); }
  /// Perpendicular from the axis to `p`.
  Eigen::Vector3d from_axis(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = p - point;
    return v - axis.dot(v) * axis;
  }
  /// Signed distance from the lateral surface, positive outside.
  double distance(const Eigen::Vector3d& p) const { return from_axis(p).norm() - radius; }
};

/// A point on a cylinder, for fitting and evaluation.
struct CylinderSample {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double sigma = 0.005;  ///< m: the point's noise
};

/// Extent of points on a cylinder: heights about `shape.point`, and angles counter-clockwise about the axis.
struct CylinderExtent {
  double low = 0, high = 0;        ///< m
  Eigen::Vector3d start{1, 0, 0};  ///< unit, perpendicular to the axis
  double span = 0;                 ///< rad: contains all points, from `start`
  double length() const { return high - low; }
};

/// Least squares of the distances in units of their noise, over the axis' four degrees of freedom and the
/// radius (Levenberg-Marquardt). `shape` is the initial value and becomes the optimum, with its point at the
/// samples' mean height and its axis within 90° of the initial one. False, and `shape` undefined, if it does
/// not converge. O(samples) a step, up to 10.
bool refine(CylinderShape& shape, std::span<const CylinderSample> samples);

/// O(samples). Not empty.
CylinderExtent extent_of(const CylinderShape& shape, std::span<const CylinderSample> samples);

/// Evidence for and against a cylinder.
struct CylinderEvidence {
  CylinderExtent extent;
  double scatter = 0;   ///< root mean square of distance / σ: 0.1 to 1.4 for cylinders
  double facets = 0;    ///< residual squares of planes along the axis per the cylinder's: ≤ 1 on edges
  double bulge = 0;     ///< m: curvature of the lateral surface along the axis (spheres, vases)
  double taper = 0;     ///< m: change of the radius from the middle to an end (cones)
  double coverage = 0;  ///< share of the side between its ends in cells with samples, on average two each
};

/// O(samples).
CylinderEvidence weigh(const CylinderShape& shape, std::span<const CylinderSample> samples);

}  // namespace octosurf::geometry
