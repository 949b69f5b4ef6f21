#include "sensing/pose_form.hpp"

namespace octosurf::sensing {

Eigen::Isometry3d pose_from(PoseForm form, const Eigen::Isometry3d& pose) {
  // x right, y down, z forward in x forward, y left, z up.
  static const Eigen::Matrix3d R_body_camera = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  const bool inverse = form == PoseForm::inverse || form == PoseForm::opengl_inverse;
  Eigen::Isometry3d T = inverse ? pose.inverse() : pose;
  if (form == PoseForm::opengl || form == PoseForm::opengl_inverse)
    T.linear() *= Eigen::Vector3d(1, -1, -1).asDiagonal();
  if (form == PoseForm::w_first) {
    const Eigen::Quaterniond q(pose.linear());
    T.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  }
  if (form == PoseForm::of_camera) T.linear() *= R_body_camera.transpose();
  if (form == PoseForm::of_body) T.linear() *= R_body_camera;
  return T;
}

}  // namespace octosurf::sensing
