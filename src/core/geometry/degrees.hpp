#pragma once

#include <numbers>

namespace octosurf::geometry {

/// Degrees are the command line's and the files', radians the code's.
inline constexpr double deg_per_rad = 180 / std::numbers::pi;
inline constexpr double rad_per_deg = std::numbers::pi / 180;

}  // namespace octosurf::geometry

namespace octosurf {
using geometry::deg_per_rad;
using geometry::rad_per_deg;
}  // namespace octosurf
