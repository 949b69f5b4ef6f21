#include "io/exporters/camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr double field_of_view_rad = 35 * std::numbers::pi / 180;  // vertical
constexpr double margin = 0.9;                                     // part of the picture a preset fills

Eigen::Vector3d forward_of(ViewFrom from) {
  constexpr std::array<std::array<double, 3>, view_names.size()> directions{
      {{0.55, 0.75, -0.75}, {0, 0, -1}, {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-1, 0, 0}}};
  return Eigen::Vector3d(directions.at(static_cast<std::size_t>(from)).data());
}

/// The nearest eye with all points in the picture. On each axis of the picture that is where the lines
/// through the margins' ends meet that leave all points between them. `centered`: on the line through the
/// target.
Eigen::Vector3d preset_eye(const Camera& camera, std::span<const Eigen::Vector3d> points,
                           const Eigen::Vector3d& target, bool centered) {
  constexpr double nearest = 0.1;  // m, of any point
  const double slope_up = margin * camera.half_height;
  double ahead = std::numeric_limits<double>::max();
  Eigen::Vector3d eye = target;
  for (const auto& [axis, slope] :
       {std::pair(camera.right, slope_up * camera.width / camera.height), std::pair(camera.up, slope_up)}) {
    double least = std::numeric_limits<double>::max(), greatest = -least;
    for (const Eigen::Vector3d& point : points) {
      const double side = (point - target).dot(axis), depth = (point - target).dot(camera.forward);
      least = std::min(least, side + slope * depth);
      greatest = std::max(greatest, side - slope * depth);
      ahead = std::min(ahead, depth - nearest);
    }
    if (centered) {
      least = std::min(least, -greatest);
      greatest = -least;
    }
    ahead = std::min(ahead, (least - greatest) / (2 * slope));
    eye += (least + greatest) / 2 * axis;
  }
  return eye + ahead * camera.forward;
}

}  // namespace

Eigen::Vector3d Camera::direction(double x, double y) const {
  const double scale = 2 * half_height / height;
  return forward + (x - width / 2.0) * scale * right + (height / 2.0 - y) * scale * up;
}

std::optional<Camera::Pixel> Camera::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d r = point - eye;
  const double depth = r.dot(forward);
  if (depth <= 0) return std::nullopt;
  const double scale = height / (2 * half_height * depth);
  return Pixel{width / 2.0 + r.dot(right) * scale, height / 2.0 - r.dot(up) * scale, depth};
}

Camera make_camera(std::span<const Eigen::Vector3d> points, const View& view) {
  const std::array<Eigen::Vector3d, 2> cube{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()};
  if (points.empty()) points = cube;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  const Eigen::Vector3d target = view.target.value_or(box.center());
  Camera camera;
  camera.width = view.width;
  camera.height = view.height;
  camera.half_height = std::tan(field_of_view_rad / 2);
  camera.forward = view.eye ? (target - *view.eye).eval() : forward_of(view.from);
  if (!camera.forward.allFinite() || !target.allFinite() || camera.forward.norm() < 1e-9)
    throw Error(Error::Kind::usage, "picture", "eye and target coincide or are not finite",
                "give two different points in metres");
  camera.forward.normalize();
  const bool vertical = std::abs(camera.forward.z()) > 1 - 1e-9;
  const Eigen::Vector3d upward = vertical ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  camera.right = camera.forward.cross(upward).normalized();
  camera.up = camera.right.cross(camera.forward);
  camera.eye = view.eye ? *view.eye : preset_eye(camera, points, target, view.target.has_value());
  Eigen::Vector3d middle = target;
  if (!view.eye && !view.target) middle.z() = box.min().z();
  camera.middle_depth = std::max((middle - camera.eye).dot(camera.forward), 1e-3);
  return camera;
}

}  // namespace octosurf::io
