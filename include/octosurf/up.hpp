#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <octosurf/map.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// A map's up direction and its source.
struct Up {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector, map frame
  /// Source of the direction.
  enum class Source {
    given,                   ///< Parameters::up
    surfaces,                ///< estimated from the surfaces and the sensors' orientations
    assumed                  ///< +z, for lack of surfaces
  } source = Source::given;  ///< source of the direction
};

/// "given", "surfaces", "assumed".
const char* name_of(Up::Source source);

/// The direction in the map's parameters; if empty, up_from_surfaces().
Up up_of(const Map& map);

/// estimate_up() of the map's current snapshot and of its scans' sensor orientations: a depth camera's -y and
/// a lidar's +z count as up. Do not insert during the call.
Up up_from_surfaces(const Map& map);

/// Estimates the up direction from floors, tables and treads.
///
/// 1. A surface is level to a direction if its normal is within 5° of it or of its opposite: floors are laid
///    more accurately, and a wheelchair ramp, 1 in 12, still counts.
/// 2. Every normal and its opposite are candidates. A candidate's score is the area of the surfaces level to
///    it, those seen from above in full, those seen from below by half, times 1 − t + t·cos²α for α below
///    90°, else 1 − t. Normals point toward the sensor, so a floor's points up and a ceiling's down; any
///    share below 1 makes the side with floor and tables win over the ceiling's.
/// 3. α is the angle to the mean of the sensors' up directions, and t nine tenths of that mean's length,
///    which is 1 for a sensor never turned and 0 for one that tumbled or is unknown. So walls, which exceed
///    floor and ceiling in a corridor, count little if the sensors were upright; the remaining tenth is for
///    unusual mountings, such as cameras that look straight down.
/// 4. The result is the area-weighted mean normal of the best candidate's level surfaces.
/// Limits: on a hillside it is the hill's normal. Without sensor orientations (an OctoMap's surfaces), wall
/// area can outvote the floor. Equivariant under rotations of the map. `sensors_up`: the mean in 3, of length
/// at most 1. Cost O(n²) in surfaces, a few ns each.
Up estimate_up(const Snapshot& snapshot, const Eigen::Vector3d& sensors_up = Eigen::Vector3d::Zero());

/// Angle between a surface's normal and up, rad: 0 a floor, π/2 a wall, π a ceiling.
double slope_rad(const Surface& surface, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

/// The shortest rotation of the map frame that brings `up` (not zero) to +z; half a turn about x if it is −z.
/// Identity if it is +z.
Eigen::Quaterniond upright(const Eigen::Vector3d& up);

}  // namespace octosurf
