#pragma once

#include <array>

namespace octosurf {

/// What the poses of a recording mean.
enum class PoseForm {
  as_given,        ///< T_map_sensor; cameras look along z with y down, lidars along x with z up
  inverse,         ///< T_sensor_map
  opengl,          ///< of a camera that looks along −z with y up
  opengl_inverse,  ///< both: a view matrix
  w_first,         ///< quaternions qw qx qy qz, read as qx qy qz qw
  of_camera,       ///< a camera's, of a lidar's scans
  of_body,         ///< a body's (x forward, z up), of a camera's scans
  in_map           ///< as given, of clouds that lie in the map's frame already
};
/// By PoseForm, as `map --pose-form` accepts them.
inline constexpr std::array<const char*, 8> pose_form_names{
    "as-given", "inverse", "opengl", "opengl-inverse", "w-first", "of-camera", "of-body", "in-map"};

}  // namespace octosurf
