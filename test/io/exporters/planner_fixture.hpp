#pragma once

#include "io/files.hpp"
#include "planning/shapes.hpp"

#include <octosurf/planner_formats.hpp>

namespace octosurf::test {

/// With its normal tilted by `tilt_rad` towards a random direction, some metres from the origin.
inline PlannerSurface random_surface(std::mt19937_64& random, SurfaceId id, double tilt_rad) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi), place(-8, 8);
  const double towards = angle(random);
  const Eigen::Vector3d axis(std::cos(towards), std::sin(towards), 0);
  PlannerSurface surface;
  surface.id = id;
  surface.T_world_surface.linear() =
      (Eigen::AngleAxisd(tilt_rad, axis) * Eigen::AngleAxisd(angle(random), Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  surface.T_world_surface.translation() = Eigen::Vector3d(place(random), place(random), place(random));
  return surface;
}

/// A level square table of 2 m with a square hole of 0.4 m in its middle, its inset by 0.1 m, and an island
/// of 0.2 m in the hole on which there is no room.
inline PlannerSurface table_with_hole(SurfaceId id) {
  using shapes::box;
  PlannerSurface table;
  table.id = id;
  table.T_world_surface.translation() = Eigen::Vector3d(3, -2, 0.75);
  table.polygons = {{box(0, 0, 2, 2), {shapes::reversed(box(0.8, 0.8, 0.4, 0.4))}},
                    {box(0.9, 0.9, 0.2, 0.2), {}}};
  table.insets = {{box(0.1, 0.1, 1.8, 1.8), {shapes::reversed(box(0.7, 0.7, 0.6, 0.6))}}};
  return table;
}

}  // namespace octosurf::test
