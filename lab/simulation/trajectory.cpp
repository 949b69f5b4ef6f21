#include "simulation/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace octosurf::simulation {
namespace {

/// Metres of way that take as long as turning by one radian.
constexpr double metres_per_radian = 0.8;

HeadPose head_pose(const View& view) {
  const Eigen::Vector3d look = view.target - view.eye;
  return {view.eye, std::atan2(look.y(), look.x()), std::atan2(look.z(), look.head<2>().norm())};
}

/// Head poses at the keys of all laps, yaw without jumps, and how long the way to each is.
struct Way {
  std::vector<HeadPose> poses;
  std::vector<double> lengths;
};

Way way_along(const std::vector<View>& keys, int laps) {
  std::vector<HeadPose> poses;
  std::vector<double> way;
  for (int lap = 0; lap < laps; ++lap)
    for (const auto& key : keys) {
      HeadPose next = head_pose(key);
      if (poses.empty()) {
        way.push_back(0);
      } else {
        const HeadPose& last = poses.back();
        next.yaw_rad = last.yaw_rad + std::remainder(next.yaw_rad - last.yaw_rad, 2 * std::numbers::pi);
        way.push_back(way.back() + (next.position - last.position).norm() +
                      metres_per_radian *
                          std::hypot(next.yaw_rad - last.yaw_rad, next.pitch_rad - last.pitch_rad));
      }
      poses.push_back(next);
    }
  return {std::move(poses), std::move(way)};
}

}  // namespace

double path_length_m(const std::vector<View>& keys) { return way_along(keys, 1).lengths.back(); }

std::vector<HeadPose> walk_path(const std::vector<View>& keys, std::size_t frames, int laps) {
  const auto [poses, way] = way_along(keys, laps);
  std::vector<HeadPose> walked;
  for (std::size_t i = 0; i < frames; ++i) {
    const double s = frames > 1 ? way.back() * static_cast<double>(i) / static_cast<double>(frames - 1) : 0.0;
    const auto above = std::upper_bound(way.begin() + 1, way.end() - 1, s);
    const auto k = static_cast<std::size_t>(above - way.begin());
    const double length = way[k] - way[k - 1];
    const double f = length > 0 ? (s - way[k - 1]) / length : 0;
    const auto& a = poses[k - 1];
    const auto& b = poses[k];
    walked.push_back({a.position + f * (b.position - a.position), a.yaw_rad + f * (b.yaw_rad - a.yaw_rad),
                      a.pitch_rad + f * (b.pitch_rad - a.pitch_rad)});
  }
  return walked;
}

}  // namespace octosurf::simulation
