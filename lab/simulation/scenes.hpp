#pragma once

#include "simulation/scene.hpp"

namespace octosurf::simulation {

// One function per scene; each builds solids and the path of one lap. Dimensions vary with
// `random` by some per cent, so that two seeds never show the same faces.

Scene make_room(Random& random);
Scene make_office(Random& random);
Scene make_stairs(Random& random);
Scene make_stones(Random& random);
Scene make_corridor(Random& random, double length);
Scene make_change(Random& random);
Scene make_flight(Random& random);
Scene make_landing(Random& random);
Scene make_spiral(Random& random);
Scene make_open(Random& random);
Scene make_storeys(Random& random);

// Shared by the scenes.

inline constexpr double head_height = 1.5;  ///< m above the ground the robot stands on

/// Floor slab over [min, max] (x, y), top at z = 0; far thicker than anything sunk into it is deep.
void add_floor(Scene& scene, const Eigen::Vector2d& min, const Eigen::Vector2d& max);

/// Four walls around [0, width] × [0, depth]; the front one (y = 0) with doors.
void add_four_walls(Scene& scene, double width, double depth, const std::vector<Door>& doors = {});

/// Top of `size` (x, y, z) with its upper side at `height`, on four legs; centre at `place`, turned.
void add_table(Scene& scene, const std::string& name, const Eigen::Vector2d& place, double yaw_rad,
               const Eigen::Vector3d& size);

/// Box of `size` standing at height `z` with its centre at `place`, turned by `yaw_rad`.
std::size_t add_standing_box(Scene& scene, const std::string& name, const Eigen::Vector2d& place, double z,
                             double yaw_rad, const Eigen::Vector3d& size, bool before = true,
                             bool after = true);

/// Once around `center` on an ellipse, counter-clockwise from `start_rad`, in `steps` key views.
/// Looks `reach` m toward the center (or away from it if negative), at targets of height `look_z`.
void walk_around(Scene& scene, const Eigen::Vector2d& center, const Eigen::Vector2d& radii, double start_rad,
                 int steps, double reach, double look_z);

}  // namespace octosurf::simulation
