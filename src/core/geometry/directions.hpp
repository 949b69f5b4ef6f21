#pragma once

#include <Eigen/Core>

namespace octosurf::geometry {

/// Throws Error(usage) naming `where` unless `direction` is finite and longer than 1e-9.
void require_direction(const Eigen::Vector3d& direction, const char* where);

}  // namespace octosurf::geometry
