#pragma once

#include "io/readers/depth_image.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <memory>
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

/// Of each pixel's ray, row by row; NaN: the lens lets none through.
using RaySlopes = std::vector<Eigen::Vector2f>;
/// Of images of that size. The last camera's are kept, as a recording's images, and a driver's, are of one:
/// 0.3 s for the first 640×480 image, then nothing.
std::shared_ptr<const RaySlopes> slopes_of(const Intrinsics& camera, const Lens& lens, std::size_t width,
                                           std::size_t height);

}  // namespace octosurf::io
