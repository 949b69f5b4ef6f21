#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>
#include <string>
#include <vector>

#include <octosurf/scan.hpp>

namespace octosurf::simulation {

inline constexpr double degree = std::numbers::pi / 180;  ///< rad

/// Where the head is and where it looks; scene or map frame's z is up. Pitch is negative downwards.
struct HeadPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double yaw_rad = 0;
  double pitch_rad = 0;
};

/// A sensor: its rays, reach, noise and pace. Rays run in the sensor's frame; cameras look along z
/// with y down, lidars along x with z up.
struct SensorModel {
  std::string name;
  SensorKind kind = SensorKind::depth_camera;
  double min_t = 0;          ///< readings lie within [min_t, max_t], in units of the ray
  double max_t = 0;          ///< m
  double visible_range = 0;  ///< m: what is seen from further away does not count as visible
  double cell = 0;           ///< m: edge of the truth's visibility cells
  double scans_per_s = 0;
  double frame_factor = 1;      ///< default number of scans, as a multiple of the depth camera's
  std::size_t image_width = 0;  ///< 0: rays form no image
  std::vector<Eigen::Vector3f> rays;

  double sigma(double t) const;    ///< m: standard deviation of t; depth-real has its own, RealCamera
  double rounded(double t) const;  ///< to what the file format holds; 0 if out of reach
  Eigen::Isometry3d mount(const HeadPose& head, std::size_t scan) const;  ///< sensor's pose
};

inline constexpr std::size_t depth_width = 640;
inline constexpr std::size_t depth_height = 480;
inline constexpr double depth_focal = 525;  ///< px
inline constexpr double depth_center_x = 319.5;
inline constexpr double depth_center_y = 239.5;

/// Throws Error(usage) naming the option and what is known if the value is not.
void require_known(const std::string& option, const std::string& value,
                   const std::vector<std::string>& known);

const std::vector<std::string>& sensor_names();
/// Throws Error(usage) for an unknown name.
SensorModel make_sensor(const std::string& name);

}  // namespace octosurf::simulation
