#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>

#include <octosurf/export.hpp>

namespace octosurf::io {

/// What a picture is to show, z up.
struct View {
  ViewFrom from = ViewFrom::iso;
  std::optional<Eigen::Vector3d> eye, target;
  int width = 0, height = 0;  ///< pixels
};

/// A pinhole camera; z is up in its pictures (y if it looks straight up or down).
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

/// A preset is as near as possible with all of `points` in the picture, with a margin; with a target, on the
/// line through it. Throws Error(usage) if eye and target coincide or are not finite.
Camera make_camera(std::span<const Eigen::Vector3d> points, const View& view);

}  // namespace octosurf::io
