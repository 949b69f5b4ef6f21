#pragma once

#include "support/testing.hpp"

#include <octosurf/scan.hpp>

namespace octosurf::test {

/// A rectangle in the map frame: corner + a·edge_u + b·edge_v, a and b in [0, 1]; visible from both sides.
struct Rectangle {
  Eigen::Vector3d corner, edge_u, edge_v;

  /// Distance along a unit direction to the rectangle, if the ray meets it.
  std::optional<double> meet(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;
};

/// Rectangles to cast rays at; whatever a ray misses is no reading.
struct Scene {
  std::vector<Rectangle> rectangles;

  Scene& rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_u,
                   const Eigen::Vector3d& edge_v);
  /// An upright box, all six sides.
  Scene& box(const Eigen::Vector3d& low, const Eigen::Vector3d& high);
  std::optional<double> cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const;
};

/// Camera pose at `eye` that looks at `target`: z forward, x right, y down.
Eigen::Isometry3d look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

struct Camera {
  int width = 200, height = 150;
  double focal = 170;    ///< pixels
  double noise = 0.002;  ///< m, along the ray
};

/// One depth image; pixels that meet nothing are NaN, as from a real camera. A scene has cast().
template <class AnyScene>
Scan camera_scan(const AnyScene& scene, const Eigen::Isometry3d& T_map_sensor, std::mt19937_64& rng,
                 const Camera& camera = {}) {
  std::normal_distribution<double> gauss(0, 1);
  Scan scan;
  scan.T_map_sensor = T_map_sensor;
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = Eigen::Vector3d((u + 0.5 - camera.width / 2.0) / camera.focal,
                                                  (v + 0.5 - camera.height / 2.0) / camera.focal, 1)
                                      .normalized();
      const std::optional<double> range = scene.cast(T_map_sensor.translation(), T_map_sensor.linear() * ray);
      if (range)
        scan.points.push_back((ray * (*range + camera.noise * gauss(rng))).cast<float>());
      else
        scan.points.push_back(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    }
  return scan;
}

extern template Scan camera_scan(const Scene&, const Eigen::Isometry3d&, std::mt19937_64&, const Camera&);

/// Cameras on a circle about what they all look at.
std::vector<Scan> orbit(const Scene& scene, const Eigen::Vector3d& target, double radius, double height,
                        int count, std::mt19937_64& rng, const Camera& camera = {});

/// One sweep of a planar laser that turns about its own z, x forward.
Scan laser_scan(const Scene& scene, const Eigen::Isometry3d& T_map_sensor, std::mt19937_64& rng,
                double half_angle = 1.0, double step = 0.004, double noise = 0.002);

/// Of a lidar that spins about its z: rings at these elevations, `steps` readings a turn.
Scan spinning_scan(const Scene& scene, const Eigen::Isometry3d& T_map_sensor, std::mt19937_64& rng,
                   const std::vector<double>& elevations, int steps, double noise);

std::vector<double> rings(double first, double step, int count);  ///< elevations, rad

/// The same scan, everything moved by T.
Scan moved(Scan scan, const Eigen::Isometry3d& T);

}  // namespace octosurf::test
