#pragma once

#include "geometry/moments.hpp"

#include <Eigen/Geometry>

namespace octosurf::geometry {

/// Whether points scatter about a plane as noise does, or lie on something else, such as a slope over stairs
/// or a facet of a cylinder. One pass over the points sums their distances in units of the noise, and fits a
/// quadric: a curved patch bends it over its whole extent; noise and rounded edges do not.
class Planarity {
 public:
  explicit Planarity(const Eigen::Isometry3d& T_map_surface) : T_surface_map_(T_map_surface.inverse()) {}

  /// `sigma`: the point's noise; `tolerance`: what it may lie off; `inner`: not on the rim, where
  /// there are points of the neighbouring face.
  void add(const Eigen::Vector3f& position, double sigma, double tolerance, bool inner);

  /// Root mean square of distance / σ. Planes show 0.1 to 1.4, a slope over stairs 2.
  double scatter() const {
    return std::sqrt(squares_ / static_cast<double>(std::max<std::size_t>(count_, 1)));
  }
  double mean_tolerance() const {
    return tolerances_ / static_cast<double>(std::max<std::size_t>(count_, 1));
  }
  /// Bends by more than 0.4 of the tolerance (of 25 mm at most) over its extent, with a radius below 1 m,
  /// and turns by more than 17°.
  bool bends() const;

 private:
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  using Matrix6d = Eigen::Matrix<double, 6, 6>;

  Eigen::Isometry3d T_surface_map_;
  std::size_t count_ = 0, inner_ = 0;
  double squares_ = 0, tolerances_ = 0;
  Matrix6d normal_matrix_ = Matrix6d::Zero();
  Vector6d right_side_ = Vector6d::Zero();
  Moments inner_moments_;  // of their (u, v)
};

}  // namespace octosurf::geometry
