#include "io/readers/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr double field_of_view_rad = 35 * std::numbers::pi / 180;  // vertical
constexpr double margin = 0.9;                                     // part of the picture a preset fills

Eigen::Vector3d forward_of(ViewFrom from) {
  switch (from) {
    case ViewFrom::top:
      return {0, 0, -1};
    case ViewFrom::front:
      return {0, 1, 0};
    case ViewFrom::back:
      return {0, -1, 0};
    case ViewFrom::left:
      return {1, 0, 0};
    case ViewFrom::right:
      return {-1, 0, 0};
    case ViewFrom::iso:
      break;
  }
  return Eigen::Vector3d(0.55, 0.75, -0.75).normalized();
}

/// The points' range between the lines that the picture's margins cut from a plane of `side` and forward: the
/// nearest possible eye is on both lines.
struct Wedge {
  double slope;  ///< of the lines
  double least = std::numeric_limits<double>::max(), greatest = -std::numeric_limits<double>::max();

  void extend(double side, double ahead) {
    least = std::min(least, side + slope * ahead);
    greatest = std::max(greatest, side - slope * ahead);
  }
  double ahead() const { return (least - greatest) / (2 * slope); }
  double side() const { return (least + greatest) / 2; }
};

/// `centered`: on the line through the target.
Eigen::Vector3d preset_eye(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                           const Eigen::Vector3d& target, bool centered) {
  constexpr double nearest = 0.1;  // m
  const double slope = margin * camera.half_height;
  Wedge across{slope * camera.width / camera.height}, along{slope};
  double ahead = -nearest;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d r = point - target;
    const double x = r.dot(camera.right), y = r.dot(camera.up), z = r.dot(camera.forward);
    across.extend(x, z);
    along.extend(y, z);
    if (centered)
      ahead = std::min(ahead, z - std::max(std::abs(x) / across.slope, std::abs(y) / along.slope));
    else
      ahead = std::min(ahead, z - nearest);
  }
  if (points.empty() || centered) return target + ahead * camera.forward;
  return target + std::min({ahead, across.ahead(), along.ahead()}) * camera.forward +
         across.side() * camera.right + along.side() * camera.up;
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

Camera make_camera(const std::vector<Eigen::Vector3d>& points, const PictureOptions& options) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  if (box.isEmpty()) box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()};
  const Eigen::Vector3d target = options.target.value_or(box.center());
  Camera camera;
  camera.width = options.width;
  camera.height = options.height;
  camera.half_height = std::tan(field_of_view_rad / 2);
  camera.forward = options.eye ? (target - *options.eye).eval() : forward_of(options.from);
  if (!camera.forward.allFinite() || !target.allFinite() || camera.forward.norm() < 1e-9) {
    throw Error(Error::Kind::usage, "picture", "eye and target coincide or are not finite",
                "give two different points in metres");
  }
  camera.forward.normalize();
  const bool vertical = std::abs(camera.forward.z()) > 1 - 1e-9;
  const Eigen::Vector3d upward = vertical ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  camera.right = camera.forward.cross(upward).normalized();
  camera.up = camera.right.cross(camera.forward);
  camera.eye = options.eye.value_or(preset_eye(camera, points, target, options.target.has_value()));
  const bool asked = options.eye || options.target;
  const Eigen::Vector3d middle = asked ? target : Eigen::Vector3d(target.x(), target.y(), box.min().z());
  camera.middle_depth = std::max((middle - camera.eye).dot(camera.forward), 1e-3);
  return camera;
}

Eigen::AlignedBox3d robust_box(const std::vector<Eigen::Vector3d>& samples) {
  Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  if (samples.empty()) return box;
  std::vector<double> values(samples.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(samples.begin(), samples.end(), values.begin(), [axis](const auto& p) { return p[axis]; });
    std::sort(values.begin(), values.end());
    const auto quantile = [&](double q) {
      return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
    };
    box.min()[axis] = quantile(0.02);
    box.max()[axis] = quantile(0.98);
  }
  return box;
}

}  // namespace octosurf::io
