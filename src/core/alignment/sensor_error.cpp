#include "alignment/sensor_error.hpp"

namespace octosurf::alignment {
namespace {

/// rad: accuracy of an uncalibrated mount, about a degree.
constexpr double usual_tilt = 0.0175;
/// Accuracy of an uncalibrated depth scale or focal length: a few per cent.
constexpr double usual_scale = 0.02;
/// 1/m: a consumer camera's disparities err by 0.03 to 0.08 px over the image (Clarkson et al. 2013, Teichman
/// et al. 2012); with f·b = 40 px·m depths are off by up to 0.002 z².
constexpr double usual_field = 0.002;
/// m: of a lidar's ranges, by their data sheets.
constexpr double usual_offset = 0.02;
/// Tangent of half a camera's usual field of view, so that the field's terms reach about 1.
constexpr double half_view = 0.6;

}  // namespace

SensorErrors distance_by_error(SensorKind sensor, const Eigen::Vector3d& reading, const Eigen::Vector3d& n) {
  SensorErrors by = SensorErrors::Zero();
  by.head<3>() = reading.cross(n);
  const double along = n.dot(reading);
  by[3] = along;
  if (sensor == SensorKind::depth_camera) {
    const double z = reading.z();
    if (!(z > 0)) return by;
    const double u = reading.x() / (half_view * z), v = reading.y() / (half_view * z);
    by.tail<6>() << 1, u, v, u * v, u * u, v * v;
    by.tail<6>() *= along * z;
  } else {
    const double range = reading.norm();
    by[4] = along / range;
    by[5] = along * reading.z() / (range * range);
  }
  return by;
}

SensorErrors usual_errors(SensorKind sensor) {
  SensorErrors usual;
  usual << Eigen::Vector3d::Constant(usual_tilt), usual_scale,
      Eigen::Matrix<double, 6, 1>::Constant(sensor == SensorKind::depth_camera ? usual_field : usual_offset);
  return usual;
}

}  // namespace octosurf::alignment
