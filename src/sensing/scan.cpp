#include <Eigen/LU>
#include <limits>

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

void require_readings(const Scan& scan) {
  if (scan.readings.empty()) return;
  std::uint64_t sum = 0;
  bool none = false;
  for (const std::uint16_t readings : scan.readings) {
    sum += readings;
    none |= readings == 0;
  }
  if (scan.readings.size() != scan.points.size() || none || sum > std::numeric_limits<std::uint32_t>::max())
    throw Error(Error::Kind::data, scan.name, "its readings do not go with its points",
                "give a number from 1 on for each point, or none at all");
}

}  // namespace octosurf
