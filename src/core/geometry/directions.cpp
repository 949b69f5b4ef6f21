#include "geometry/directions.hpp"

#include <octosurf/error.hpp>

namespace octosurf::geometry {

void require_direction(const Eigen::Vector3d& direction, const char* where) {
  if (direction.allFinite() && direction.norm() > 1e-9) return;
  throw Error(Error::Kind::usage, where, "is no direction", "give a vector that is finite and not zero");
}

}  // namespace octosurf::geometry
