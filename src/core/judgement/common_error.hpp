#pragma once

#include "judgement/view.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace octosurf::judgement {

/// By which one may move all readings at once: turn of the mount, its shift, scale of ranges, of a camera's
/// distances from its axis (relative), delay of the poses in scans, shift of a camera's axis in focal
/// lengths.
using CommonParameters = Eigen::Matrix<double, 11, 1>;

/// How far a place of one view lies from that of another.
struct Offset {
  Eigen::Matrix<float, 11, 1> by;  ///< derivative by the common parameters
  float distance = 0;              ///< m, along the normal
  std::size_t view = 0;            ///< of the normal: View::number
};
/// `seen`: the point of `into` that is `distance` off the sample of `from`.
Offset offset_of(const View& from, const Sample& sample, const View& into, const Eigen::Vector3f& seen,
                 float distance);

/// What brings offsets nearest to nothing, by iteratively reweighted least squares; a parameter by which
/// nothing moves stays 0.
CommonParameters fitted(const std::vector<Offset>& offsets, double resolution);

/// One constant error of all scans. It is found by least squares, so it is right only if it is small.
struct CommonError {
  double explains = 0;  ///< share of the offsets of views that it was not fitted to
  double moves_m = 0;   ///< how far it moves places against each other, root mean square
};
CommonError common_error(std::vector<Offset> offsets, double resolution);

}  // namespace octosurf::judgement
