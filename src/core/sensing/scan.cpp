#include <Eigen/LU>

#include <octosurf/error.hpp>
#include <octosurf/scan.hpp>

namespace octosurf {

void require_rigid(const Eigen::Isometry3d& T, const std::string& where) {
  const Eigen::Matrix3d R = T.linear();
  const bool finite = T.matrix().allFinite();
  if (finite && (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 1e-3 &&
      R.determinant() > 0)
    return;
  throw Error(Error::Kind::data, where, finite ? "pose is not a rigid motion" : "pose is not finite",
              "the rotation must be orthonormal with determinant +1");
}

}  // namespace octosurf
