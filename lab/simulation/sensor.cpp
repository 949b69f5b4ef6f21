#include "simulation/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

// Structured-light or active-stereo camera.
SensorModel depth_camera(const std::string& name) {
  SensorModel model{name, SensorKind::depth_camera, 0.4, 5.0, 4.0, 0.01, 30, 1, depth_width, {}};
  for (std::size_t y = 0; y < depth_height; ++y)
    for (std::size_t x = 0; x < depth_width; ++x)
      model.rays.push_back(Eigen::Vector3d((static_cast<double>(x) - depth_center_x) / depth_focal,
                                           (static_cast<double>(y) - depth_center_y) / depth_focal, 1)
                               .cast<float>());
  return model;
}

Eigen::Vector3f lidar_ray(double azimuth_rad, double elevation_rad) {
  return Eigen::Vector3d(std::cos(elevation_rad) * std::cos(azimuth_rad),
                         std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad))
      .cast<float>();
}

constexpr int strip_lines = 3;               ///< lines of a tilting laser's scan
constexpr double line_step = 0.25 * degree;  ///< tilt between lines: 10°/s at 40 lines/s
constexpr double tilt_low = -70 * degree;
constexpr double tilt_high = -15 * degree;  ///< higher, whole scans of an open place would be empty

// 2-D laser of 1081 beams over 270° and 40 lines/s (Hokuyo UTM-30LX) that nods slowly.
SensorModel tilting_laser() {
  SensorModel model{"tilting", SensorKind::lidar, 0.1, 30, 30, 0.05, 40.0 / strip_lines, 7.5, 0, {}};
  for (int line = 0; line < strip_lines; ++line) {
    const Eigen::Matrix3f nod =
        Eigen::AngleAxisd(-(line - (strip_lines - 1) / 2.0) * line_step, Eigen::Vector3d::UnitY())
            .toRotationMatrix()
            .cast<float>();
    for (int beam = 0; beam <= 1080; ++beam)
      model.rays.emplace_back(nod * lidar_ray((beam - 540) * 0.25 * degree, 0));
  }
  return model;
}

// 3-D lidar of 32 beams from −35° to +15°.
SensorModel spinning_lidar() {
  SensorModel model{"spinning", SensorKind::lidar, 0.3, 50, 50, 0.05, 10, 1, 0, {}};
  constexpr int beams = 32;
  constexpr int columns = 1200;
  for (int column = 0; column < columns; ++column)
    for (int beam = 0; beam < beams; ++beam)
      model.rays.push_back(
          lidar_ray(360 * degree * column / columns, (-35 + 50.0 * beam / (beams - 1)) * degree));
  return model;
}

/// Nods between tilt_low and tilt_high at an even pace, from the top.
double tilt_rad(std::size_t scan) {
  const double span = tilt_high - tilt_low;
  const double way = std::fmod(static_cast<double>(scan) * strip_lines * line_step, 2 * span);
  return way < span ? tilt_high - way : tilt_low + (way - span);
}

}  // namespace

void require_known(const std::string& option, const std::string& value,
                   const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), value) != known.end()) return;
  std::string names;
  for (const auto& name : known) names += (names.empty() ? "" : ", ") + name;
  throw Error(Error::Kind::usage, option, "'" + value + "' is not known", "choose one of " + names);
}

const std::vector<std::string>& sensor_names() {
  static const std::vector<std::string> names{"depth", "depth-real", "tilting", "spinning"};
  return names;
}

SensorModel make_sensor(const std::string& name) {
  if (name == "depth" || name == "depth-real") return depth_camera(name);
  if (name == "tilting") return tilting_laser();
  require_known("sensor", name, sensor_names());
  return spinning_lidar();
}

double SensorModel::sigma(double t) const {
  if (kind == SensorKind::depth_camera) return 0.0008 + 0.0016 * (t - 0.4) * (t - 0.4);
  return name == "tilting" ? 0.006 + 0.001 * t : 0.008;
}

double SensorModel::rounded(double t) const {
  if (t < min_t || t > max_t) return 0;
  return kind == SensorKind::depth_camera ? std::round(t * 1000) / 1000 : t;
}

Eigen::Isometry3d SensorModel::mount(const HeadPose& head, std::size_t scan) const {
  // The camera looks where the head does; the lidars keep their own tilt.
  const double pitch_rad = kind == SensorKind::depth_camera ? head.pitch_rad
                           : name == "tilting"              ? tilt_rad(scan)
                                                            : 0;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = head.position;
  T.linear() = (Eigen::AngleAxisd(head.yaw_rad, Eigen::Vector3d::UnitZ()) *
                Eigen::AngleAxisd(-pitch_rad, Eigen::Vector3d::UnitY()))
                   .toRotationMatrix();
  if (kind == SensorKind::depth_camera) {
    Eigen::Matrix3d R_head_camera;
    R_head_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    T.linear() = T.linear() * R_head_camera;
  }
  return T;
}

}  // namespace octosurf::simulation
