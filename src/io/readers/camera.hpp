#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include <octosurf/export.hpp>

namespace octosurf::io {

/// A pinhole camera; the map's z is up in its pictures (y if it looks straight up or down).
struct Camera {
  Eigen::Vector3d eye, right, up, forward;
  double half_height = 0;   ///< of the picture, at distance 1
  double middle_depth = 1;  ///< m, along `forward`, of the target; of a preset, of the ground's middle
  int width = 0, height = 0;

  /// Direction through a pixel position, 1 along `forward`; (0, 0) is the picture's upper left corner.
  Eigen::Vector3d direction(double x, double y) const;

  struct Pixel {
    double x, y, depth;  ///< depth: m, along `forward`
  };
  /// A point's pixel position; empty if behind the camera.
  std::optional<Pixel> project(const Eigen::Vector3d& point) const;
};

/// The camera for PictureOptions. A preset is as near as possible with all of `points` in the picture, with a
/// margin; with a target, on the line through it. Throws Error(usage) if eye and target coincide or are not
/// finite.
Camera make_camera(const std::vector<Eigen::Vector3d>& points, const PictureOptions& options);

/// Per axis the 2 to 98 % range of `samples`; the unit cube if there are none.
Eigen::AlignedBox3d robust_box(const std::vector<Eigen::Vector3d>& samples);

}  // namespace octosurf::io
