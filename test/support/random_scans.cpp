#include "support/random_scans.hpp"

namespace octosurf::test {

Scan room_scan(std::mt19937_64& rng, std::size_t rays, const Eigen::Vector3d& half,
               const Eigen::Vector3d& centre, double noise) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> gauss(0, noise);
  Scan scan;
  scan.T_map_sensor = Eigen::Isometry3d::Identity();
  scan.T_map_sensor.rotate(Eigen::AngleAxisd(uniform(rng) * std::numbers::pi,
                                             Eigen::Vector3d(uniform(rng), uniform(rng), 1.1).normalized()));
  const Eigen::Vector3d inside(0.6 * half.x() * uniform(rng), 0.6 * half.y() * uniform(rng),
                               0.6 * half.z() * uniform(rng));
  scan.T_map_sensor.translation() = centre + inside;
  const Eigen::Isometry3d T_sensor_map = scan.T_map_sensor.inverse();
  for (std::size_t i = 0; i < rays; ++i) {
    Eigen::Vector3d direction(uniform(rng), uniform(rng), uniform(rng));
    if (direction.norm() < 1e-3) continue;
    direction.normalize();
    double range = 1e9;
    for (int a = 0; a < 3; ++a)
      range = std::min(range, ((direction[a] > 0 ? half[a] : -half[a]) - inside[a]) / direction[a]);
    const Eigen::Vector3d hit = scan.T_map_sensor.translation() + direction * (range + gauss(rng));
    scan.points.push_back((T_sensor_map * hit).cast<float>());
  }
  return scan;
}

Scan rays_around(std::mt19937_64& rng, const Eigen::Vector3d& origin, std::size_t count, double near,
                 double far) {
  std::uniform_real_distribution<double> uniform(-1, 1), length(near, far);
  Scan scan;
  scan.T_map_sensor.translation() = origin;
  while (scan.points.size() < count) {
    Eigen::Vector3d direction(uniform(rng), uniform(rng), uniform(rng));
    if (rng() % 8 == 0) direction.y() = 0;
    if (rng() % 8 == 0) direction.z() = direction.x();
    if (direction.norm() > 0.1) scan.points.push_back((direction.normalized() * length(rng)).cast<float>());
  }
  return scan;
}

}  // namespace octosurf::test
