#include "io/readers/reading_rules.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace octosurf::io {

void drop_no_returns(Scan& scan, bool depth_image, const ScanSourceOptions& options) {
  constexpr float same_m = 1e-3F;     // as formats store values
  constexpr float no_farther = 1e8F;  // in metres or millimetres: a format's largest number
  const bool camera = scan.sensor == SensorKind::depth_camera;
  const auto is_named = [&](const Eigen::Vector3f& p) {
    return std::ranges::any_of(options.no_return, [&](double value) {
      const auto none = static_cast<float>(value);
      return (!depth_image && std::abs(p.norm() - none) <= same_m) ||
             (camera && std::abs(p.z() - none) <= same_m);
    });
  };
  // Of most depth images nothing is to be dropped.
  if (depth_image && options.no_return.empty() &&
      std::ranges::none_of(scan.points, [](const Eigen::Vector3f& p) { return p.z() >= no_farther; }))
    return;
  for (Eigen::Vector3f& p : scan.points)
    if (p.allFinite() && (p.cwiseAbs().maxCoeff() >= no_farther || is_named(p)))
      p.setConstant(std::numeric_limits<float>::quiet_NaN());
}

std::size_t erase_own(Scan& scan, std::span<const SelfBox> boxes,
                      const std::function<Eigen::Isometry3d(const std::string& frame)>& sensor_in) {
  std::size_t own = 0;
  for (const SelfBox& self : boxes) {
    const Eigen::Isometry3f T =
        (self.frame ? sensor_in(*self.frame) : Eigen::Isometry3d::Identity()).cast<float>();
    const Eigen::AlignedBox3f box = self.box.cast<float>();
    for (Eigen::Vector3f& point : scan.points) {
      if (!box.contains(T * point)) continue;  // nor does it contain NaN
      point.setConstant(std::numeric_limits<float>::quiet_NaN());
      ++own;
    }
  }
  return own;
}

}  // namespace octosurf::io
