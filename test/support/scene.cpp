#include "support/scene.hpp"

namespace octosurf::test {

std::optional<double> Rectangle::meet(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d n = edge_u.cross(edge_v);
  const double cos_incidence = n.dot(direction);
  if (std::fabs(cos_incidence) < 1e-12) return {};
  const double range = n.dot(corner - from) / cos_incidence;
  if (range <= 0) return {};
  const Eigen::Vector3d at = from + range * direction - corner;
  const double a = at.dot(edge_u) / edge_u.squaredNorm(), b = at.dot(edge_v) / edge_v.squaredNorm();
  if (a < 0 || a > 1 || b < 0 || b > 1) return {};
  return range;
}

Scene& Scene::rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_u,
                        const Eigen::Vector3d& edge_v) {
  rectangles.push_back({corner, edge_u, edge_v});
  return *this;
}

Scene& Scene::box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const Eigen::Vector3d e = high - low;
  const Eigen::Vector3d x(e.x(), 0, 0), y(0, e.y(), 0), z(0, 0, e.z());
  rectangle(low, x, y).rectangle(low, x, z).rectangle(low, y, z);
  return rectangle(low + z, x, y).rectangle(low + y, x, z).rectangle(low + x, y, z);
}

std::optional<double> Scene::cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
  std::optional<double> nearest;
  for (const Rectangle& r : rectangles)
    if (const auto range = r.meet(from, direction); range && (!nearest || *range < *nearest)) nearest = range;
  return nearest;
}

template Scan camera_scan(const Scene&, const Eigen::Isometry3d&, std::mt19937_64&, const Camera&);

Eigen::Isometry3d look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d up = std::fabs(z.z()) > 0.99 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = z.cross(up).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = eye;
  return pose;
}

std::vector<Scan> orbit(const Scene& scene, const Eigen::Vector3d& target, double radius, double height,
                        int count, std::mt19937_64& rng, const Camera& camera) {
  std::vector<Scan> scans;
  for (int i = 0; i < count; ++i) {
    const double a = 2 * std::numbers::pi * i / count + 0.3;
    const Eigen::Vector3d eye = target + Eigen::Vector3d(radius * std::cos(a), radius * std::sin(a), height);
    scans.push_back(camera_scan(scene, look_at(eye, target), rng, camera));
  }
  return scans;
}

Scan laser_scan(const Scene& scene, const Eigen::Isometry3d& T_map_sensor, std::mt19937_64& rng,
                double half_angle, double step, double noise) {
  std::normal_distribution<double> gauss(0, noise);
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor = T_map_sensor;
  for (double a = -half_angle; a <= half_angle; a += step) {
    const Eigen::Vector3d ray(std::cos(a), std::sin(a), 0);
    if (const auto range = scene.cast(T_map_sensor.translation(), T_map_sensor.linear() * ray))
      scan.points.push_back((ray * (*range + gauss(rng))).cast<float>());
  }
  return scan;
}

Scan spinning_scan(const Scene& scene, const Eigen::Isometry3d& T_map_sensor, std::mt19937_64& rng,
                   const std::vector<double>& elevations, int steps, double noise) {
  std::normal_distribution<double> gauss(0, noise);
  Scan scan;
  scan.sensor = SensorKind::lidar;
  scan.T_map_sensor = T_map_sensor;
  for (const double up : elevations)
    for (int step = 0; step < steps; ++step) {
      const double a = 2 * std::numbers::pi * step / steps;
      const Eigen::Vector3d ray(std::cos(up) * std::cos(a), std::cos(up) * std::sin(a), std::sin(up));
      if (const auto range = scene.cast(T_map_sensor.translation(), T_map_sensor.linear() * ray))
        scan.points.push_back((ray * (*range + gauss(rng))).cast<float>());
    }
  return scan;
}

/// From `first` on, `count` of them.
std::vector<double> rings(double first, double step, int count) {
  std::vector<double> elevations;
  for (int ring = 0; ring < count; ++ring) elevations.push_back(first + step * ring);
  return elevations;
}

Scan moved(Scan scan, const Eigen::Isometry3d& T) {
  scan.T_map_sensor = T * scan.T_map_sensor;
  return scan;
}

}  // namespace octosurf::test
