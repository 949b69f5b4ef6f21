#pragma once

#include "geometry/directions.hpp"

#include <numbers>

#include <octosurf/error.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/up.hpp>

namespace octosurf::planning {

/// Throws Error for an invalid direction or angle.
inline void require_limit(const SlopeLimit& limit) {
  geometry::require_direction(limit.up, "up");
  if (!(limit.max_slope_rad >= 0))
    throw Error(Error::Kind::usage, "max_slope", "is not an angle", "must be at least 0");
}

inline bool within(const SlopeLimit& limit, const Surface& surface) {
  return limit.max_slope_rad >= std::numbers::pi || slope_rad(surface, limit.up) <= limit.max_slope_rad;
}

}  // namespace octosurf::planning
