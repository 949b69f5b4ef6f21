#include "check/meaning.hpp"

#include "geometry/directions.hpp"
#include "sensing/pose_form.hpp"

#include <cmath>

namespace octosurf::check {
namespace {

/// m: closer to each other than a camera resolves, readings of a frequent value are that value.
constexpr double same_m = 1e-3;

Eigen::Isometry3d read_pose(const Meaning& meaning, const Eigen::Isometry3d& given) {
  using Rotation = Meaning::Rotation;
  Eigen::Isometry3d T = given;
  if (meaning.rotation == Rotation::inverse_pose) T = sensing::pose_from(sensing::PoseForm::inverse, given);
  if (meaning.rotation == Rotation::w_first) T = sensing::pose_from(sensing::PoseForm::w_first, given);
  if (meaning.rotation == Rotation::transposed) T.linear() = given.linear().transpose();
  T.translation() = meaning.pose_scale * (meaning.position_axes * T.translation());
  T.linear() *= meaning.sensor_axes;
  return T * meaning.mount;
}

}  // namespace

std::optional<Eigen::Isometry3d> Meaning::pose_of(const Recording& recording, std::size_t index) const {
  const auto& poses = recording.poses();
  if (without_odd && poses[index].oddity) return {};
  const double place = static_cast<double>(index) + late, before = std::floor(place);
  if (before < 0 || place > static_cast<double>(poses.size() - 1)) return {};
  const auto i = static_cast<std::size_t>(before);
  const Eigen::Isometry3d T = read_pose(*this, poses[i].T_map_sensor);
  if (place == before) return T;
  return geometry::pose_between(T, read_pose(*this, poses[i + 1].T_map_sensor), place - before);
}

std::vector<Eigen::Vector3f> Meaning::readings_of(const Scan& scan) const {
  std::vector<Eigen::Vector3f> readings;
  readings.reserve(scan.points.size());
  const bool camera = scan.sensor == SensorKind::depth_camera;
  const Eigen::Isometry3f T_sensor_map = scan.T_map_sensor.inverse().cast<float>();
  const auto focal_factor = static_cast<float>(1 / focal), scale = static_cast<float>(readings_scale);
  for (Eigen::Vector3f p : scan.points) {
    const auto z = static_cast<double>(p.z());
    if (no_return && std::fabs((camera ? z : static_cast<double>(p.norm())) - *no_return) <= same_m) continue;
    if (reading == Reading::range) p *= p.z() / p.norm();
    if (reading == Reading::inverse_depth) p *= static_cast<float>(constant / (z * z));
    if (reading == Reading::in_map) p = T_sensor_map * p;
    if (focal != 1 || !aside.isZero()) p.head<2>() = focal_factor * p.head<2>() + p.z() * aside.cast<float>();
    if (mirrored) p.y() = -p.y();
    if (p.allFinite() && !p.isZero()) readings.push_back(scale * p);
  }
  return readings;
}

bool Meaning::leaves_out(const Recording& recording) const {
  for (std::size_t i = 0; i < recording.poses().size(); ++i)
    if (!pose_of(recording, i)) return true;
  return false;
}

std::string Meaning::by_hand() const {
  if (reading != Reading::points && reading != Reading::in_map)
    return "convert the images to depth along the camera's axis";
  if (mirrored) return "reverse the y axis of the readings (images: mirror them)";
  if (focal != 1) return "--intrinsics FILE with these focal lengths and this principal point";
  return {};
}

bool Meaning::same_readings(const Meaning& other) const {
  return reading == other.reading && constant == other.constant && mirrored == other.mirrored &&
         readings_scale == other.readings_scale && focal == other.focal && aside == other.aside &&
         no_return == other.no_return;
}

}  // namespace octosurf::check
