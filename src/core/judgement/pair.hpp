#pragma once

#include "judgement/common_error.hpp"
#include "judgement/view.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace octosurf::judgement {

/// How far readings may lie apart that mean the same place.
class Tolerance {
 public:
  Tolerance(const std::vector<const View*>& views, double resolution);
  double resolution() const { return resolution_; }
  /// m: half a voxel, and three deviations of the sensor's noise at the larger range. Then most places are
  /// off, whatever way their surfaces face, where these lie apart by twice as much: a voxel, and the noise,
  /// which is what doubles a map's faces.
  float at(float range_a, float range_b) const {
    return static_cast<float>(resolution_ / 2) + 3 * std::max(noise_of(range_a), noise_of(range_b));
  }

 private:
  static constexpr std::size_t classes = 24;  // of range, three to an octave, from 6 cm on
  static std::size_t class_of(float range);
  float noise_of(float range) const { return noise_[class_of(range)]; }
  double resolution_;
  std::array<float, classes> noise_{};  // m
};

/// Places that two views have in common.
struct Places {
  std::size_t agree = 0;
  std::size_t off = 0;      ///< a surface beside the reading, along its normal
  std::size_t through = 0;  ///< the other view has seen through there
  /// Share of what faces along one motion of a view that it would bring together: an error's along one axis.
  double moved = 0;
  Eigen::Vector3d along = Eigen::Vector3d::Zero();    ///< that motion's shift, map axes
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();  ///< of surfaces that both see: sum of squares, map axes

  std::size_t all() const { return agree + off + through; }
  std::size_t apart() const { return off + through; }
  bool judged() const;
  bool contradict() const;
  bool moves() const { return 2 * moved > 1; }
  /// Surfaces enough face along a direction of length 1.
  bool measure(const Eigen::Vector3d& direction) const;
};

/// Compares the samples of each with the points of the other. Adds of one in three how far it is off.
Places compare(const View& a, const View& b, const Tolerance& tolerance, std::vector<Offset>& offsets);

}  // namespace octosurf::judgement
