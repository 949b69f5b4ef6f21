#pragma once

#include <Eigen/Geometry>

#include <octosurf/pose_forms.hpp>

namespace octosurf::sensing {

using octosurf::pose_form_names;
using octosurf::PoseForm;

/// T_map_sensor of a pose in that form.
Eigen::Isometry3d pose_from(PoseForm form, const Eigen::Isometry3d& pose);

}  // namespace octosurf::sensing
