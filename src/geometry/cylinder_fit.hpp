#pragma once

#include <Eigen/Core>
#include <span>

namespace octosurf::geometry {

/// An unbounded cylinder; map frame.
struct CylinderShape {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the axis, near what it was fitted to
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit
  double radius = 0;                                ///< m

  double height(const Eigen::Vector3d& p) const { return axis.dot(p - point); }
  /// From the axis to `p`, square to it.
  Eigen::Vector3d from_axis(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = p - point;
    return v - axis.dot(v) * axis;
  }
  /// Off the mantle, positive outside.
  double distance(const Eigen::Vector3d& p) const { return from_axis(p).norm() - radius; }
};

/// A point on a cylinder, for fitting and judging.
struct CylinderSample {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit; zero: not known
  double sigma = 0.005;                              ///< m: the point's noise
};

/// Of points on a cylinder: heights about `shape.point`, and angles counter-clockwise about the axis.
struct CylinderExtent {
  double low = 0, high = 0;        ///< m
  Eigen::Vector3d start{1, 0, 0};  ///< unit, square to the axis
  double span = 0;                 ///< rad: all points lie within it from `start`; the rest is the widest gap
  double length() const { return high - low; }
};

/// Least squares of the distances in units of their noise, over the axis' four freedoms and the radius
/// (Levenberg-Marquardt). `shape` is where to start from and becomes the optimum, its point at the
/// samples' mean height, its axis within 90° of the one before. False, and `shape` undefined, if there
/// is none near. O(samples) a step, up to 10.
bool refine(CylinderShape& shape, std::span<const CylinderSample> samples);

/// O(samples). Not empty.
CylinderExtent extent_of(const CylinderShape& shape, std::span<const CylinderSample> samples);

/// What speaks for a cylinder and against it.
struct CylinderEvidence {
  CylinderExtent extent;
  double scatter = 0;   ///< root mean square of distance / σ: 0.1 to 1.4 where it is one
  double facets = 0;    ///< squares left by the best of planes along the axis, two or four, per squares left
                        ///< by the cylinder: 1 and less on edges and posts
  double bulge = 0;     ///< m: how far the mantle is from straight along the axis (spheres, vases)
  double taper = 0;     ///< m: how far it widens from the middle to an end (cones)
  double lean = 0;      ///< largest part of the mean normal along the axis, over its length (spheres, cones)
  double coverage = 0;  ///< share of the mantle within the extent that holds points, in cells of `cell`
};

/// O(samples).
CylinderEvidence weigh(const CylinderShape& shape, std::span<const CylinderSample> samples, double cell);

}  // namespace octosurf::geometry
