#pragma once

#include "support/scene.hpp"

namespace octosurf::test {

/// A room with a box in it.
inline Scene room_with_a_box() {
  Scene scene;
  scene.box({-1.5, -1.2, 0.01}, {1.5, 1.2, 2.0}).box({0.3, -0.5, 0.01}, {0.8, 0.2, 0.4});
  return scene;
}

/// Scans by a camera that walks by, looking down at the box.
inline std::vector<Scan> pass_by(const Scene& scene, std::mt19937_64& rng, int count) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d eye(-1.2 + 0.05 * i, 0.9 - 0.06 * i, 1.3);
    scans.push_back(camera_scan(scene, look_at(eye, {0.5, 0.0, 0.1}), rng));
    scans.back().name = "scan " + std::to_string(i);
  }
  return scans;
}

/// Scans of it by a camera that turns round, 34° a scan, thirty scans a second.
inline std::vector<Scan> room_tour(std::mt19937_64 rng, int count) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const double a = 0.6 * i;
    const Eigen::Vector3d eye(-0.6 + 0.02 * i, 0.3 * std::sin(a), 1.0);
    const Eigen::Vector3d forward(std::cos(a), std::sin(a), -0.45);
    scans.push_back(camera_scan(room_with_a_box(), look_at(eye, eye + forward), rng));
    scans.back().stamp_s = i / 30.0;
    scans.back().name = "scan " + std::to_string(i);
  }
  return scans;
}

}  // namespace octosurf::test
