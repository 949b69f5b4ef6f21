#include "io/readers/reading_rules.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace octosurf::io {

std::vector<std::size_t> drop_no_returns(Scan& scan, bool depth_image, const ScanSourceOptions& options) {
  constexpr float same_m = 1e-3F;     // as formats store values
  constexpr float no_farther = 1e8F;  // in metres or millimetres: a format's largest number
  const auto clear_m = static_cast<float>(options.clear_no_return_m);
  const bool camera = scan.sensor == SensorKind::depth_camera;
  const auto is_named = [&](const Eigen::Vector3f& p) {
    return std::ranges::any_of(options.no_return, [&](double value) {
      const auto none = static_cast<float>(value);
      return (!depth_image && std::abs(p.norm() - none) <= same_m) ||
             (camera && std::abs(p.z() - none) <= same_m);
    });
  };
  std::vector<std::size_t> free;
  // Of most depth images nothing is to be dropped.
  if (depth_image && options.no_return.empty() &&
      std::ranges::none_of(scan.points, [](const Eigen::Vector3f& p) { return p.z() >= no_farther; }))
    return free;
  std::vector<bool> without(clear_m > 0 ? scan.points.size() : 0);  // in their direction nothing was met
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    Eigen::Vector3f& p = scan.points[i];
    if (!p.allFinite()) continue;
    const bool huge = p.cwiseAbs().maxCoeff() >= no_farther, named = is_named(p);
    if (!huge && !named) continue;
    if (clear_m > 0 && (named || depth_image)) {
      without[i] = true;
      p *= clear_m / p.norm();
    } else {
      p.setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  }
  // Pixels have their margin; of clouds, rays beside a reading may graze its surface.
  for (std::size_t i = 0; i < without.size(); ++i) {
    if (!without[i]) continue;
    if (depth_image || ((i == 0 || without[i - 1]) && (i + 1 == scan.points.size() || without[i + 1])))
      free.push_back(i);
    else
      scan.points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  return free;
}

void move_to_free_rays(Scan& scan, const std::vector<std::size_t>& places) {
  if (places.empty()) return;
  std::size_t kept = places.front(), next = 0;
  for (std::size_t i = kept; i < scan.points.size(); ++i) {
    if (next < places.size() && places[next] == i) {
      scan.free_rays.push_back(scan.points[i]);
      ++next;
      continue;
    }
    scan.points[kept] = scan.points[i];
    if (!scan.times_s.empty()) scan.times_s[kept] = scan.times_s[i];
    if (!scan.origins.empty()) scan.origins[kept] = scan.origins[i];
    ++kept;
  }
  scan.points.resize(kept);
  if (!scan.times_s.empty()) scan.times_s.resize(kept);
  if (!scan.origins.empty()) scan.origins.resize(kept);
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
