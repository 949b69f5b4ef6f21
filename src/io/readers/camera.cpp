#include "io/readers/camera.hpp"

#include <algorithm>
#include <cmath>
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

}  // namespace

Eigen::Vector3d Camera::direction(double x, double y) const {
  const double scale = 2 * half_height / height;
  return (forward + (x - width / 2.0) * scale * right + (height / 2.0 - y) * scale * up).normalized();
}

std::optional<Camera::Pixel> Camera::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d r = point - eye;
  const double depth = r.dot(forward);
  if (depth <= 0) return std::nullopt;
  const double scale = height / (2 * half_height * depth);
  return Pixel{width / 2.0 + r.dot(right) * scale, height / 2.0 - r.dot(up) * scale, r.norm()};
}

Camera make_camera(const Eigen::AlignedBox3d& box, const PictureOptions& options) {
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

  double back = 0.1;  // m
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d r = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) - target;
    const double half_width = camera.half_height * options.width / options.height;
    const double needed = std::max(std::abs(r.dot(camera.right)) / (margin * half_width),
                                   std::abs(r.dot(camera.up)) / (margin * camera.half_height));
    back = std::max(back, needed - r.dot(camera.forward));
  }
  camera.eye = options.eye.value_or(target - back * camera.forward);
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
