#include "judgement/walks.hpp"

#include "alignment/surfaces_by_hand.hpp"

namespace octosurf::test {

Eigen::Isometry3d place(int i) {
  const double t = 2 * std::numbers::pi * i / scans_of_walk;
  return Eigen::Isometry3d(Eigen::Translation3d(
      middle_of_room + Eigen::Vector3d(0.9 * std::sin(t), 1.2 * std::sin(2 * t), 0.2 * std::sin(3 * t))));
}

Scans numbered(Scans scans) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    scans[i].name = "scan " + std::to_string(i);
    scans[i].stamp_s = 0.1 * static_cast<double>(i);
  }
  return scans;
}

Scans camera_walk(std::mt19937_64& rng) {
  Scans scans;
  for (int i = 0; i < scans_of_walk; ++i) {
    const Eigen::Vector3d eye = place(i).translation();
    const double turn = 4 * std::numbers::pi * i / scans_of_walk;
    const Eigen::Vector3d ahead(std::cos(turn), std::sin(turn), -0.3 + 0.2 * std::sin(3 * turn));
    scans.push_back(camera_scan(furnished_room(), look_at(eye, eye + ahead), rng,
                                {.width = 120, .height = 90, .focal = 85, .noise = 0.004}));
  }
  return numbered(scans);
}

Scan line(const Eigen::Isometry3d& T_map_sensor, double tilt_rad, std::mt19937_64& rng) {
  return laser_scan(furnished_room(), T_map_sensor * Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitX()),
                    rng, 3.1, 0.03, 0.01);
}

Scans lidar_walk(std::mt19937_64& rng) {
  Scans scans;
  for (int i = 0; i < scans_of_walk; ++i) {
    const Eigen::Isometry3d T =
        place(i) * Eigen::AngleAxisd(0.2 * i, Eigen::Vector3d(0.2, 0.1, 1).normalized());
    Scan scan;
    scan.sensor = SensorKind::lidar;
    scan.T_map_sensor = T;
    for (int ring = 0; ring < 32; ++ring) {
      const double tilt = -0.8 + 0.05 * ring;
      for (const Eigen::Vector3f& point : line(T, tilt, rng).points)
        scan.points.push_back(Eigen::AngleAxisf(static_cast<float>(tilt), Eigen::Vector3f::UnitX()) * point);
    }
    scans.push_back(std::move(scan));
  }
  return numbered(scans);
}

Change each(const std::function<void(Scan&)>& change) {
  return [change](Scans& scans) { std::ranges::for_each(scans, change); };
}

Change scaled(const Eigen::Vector3f& factors) {
  return each([factors](Scan& scan) {
    for (Eigen::Vector3f& point : scan.points) point = point.cwiseProduct(factors);
  });
}

Change mounted(const Eigen::Isometry3d& T) {
  return each([T](Scan& scan) { scan.T_map_sensor = scan.T_map_sensor * T; });
}

Change late(std::size_t by) {
  return [by](Scans& scans) {
    for (std::size_t i = scans.size(); i-- > by;) scans[i].T_map_sensor = scans[i - by].T_map_sensor;
    scans.erase(scans.begin(), scans.begin() + static_cast<std::ptrdiff_t>(by));
  };
}

}  // namespace octosurf::test
