#pragma once

#include "io/readers/depth_image.hpp"

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::io {

/// A lens' distortion as CameraInfo and OpenCV have it.
struct Lens {
  std::string model;      ///< plumb_bob, rational_polynomial, equidistant; others are not known
  std::vector<double> d;  ///< k1 k2 p1 p2 k3 (k4 k5 k6); of equidistant k1 k2 k3 k4
  bool operator==(const Lens&) const = default;
  bool bends() const;  ///< some number is not 0
};

bool is_known(const Lens& lens);

/// Where a ray of these slopes against the optical axis is seen, at focal length 1 (OpenCV's projectPoints).
Eigen::Vector2d distorted(const Lens& lens, const Eigen::Vector2d& slopes);

/// The largest slope up to which what lies farther out is seen farther out; polynomials turn back beyond.
double reach_of(Lens lens);

/// The slopes of the ray, up to `reach`, that is seen there; empty: none is found.
std::optional<Eigen::Vector2d> undistorted(const Lens& lens, const Eigen::Vector2d& seen, double reach);

/// Puts the points of an image of that size, one to a pixel at most, on the rays that the lens let through;
/// those without become NaN. Depths stay. 0.3 s for the first 640×480 image of a camera, then some ms.
void undistort(std::vector<Eigen::Vector3f>& points, const Intrinsics& camera, const Lens& lens, int width,
               int height);

}  // namespace octosurf::io
