#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <octosurf/map.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// Which way is up in a map, and how that is known.
struct Up {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector, map frame
  /// How it is known.
  enum class Source {
    given,                   ///< Parameters::up
    surfaces,                ///< an estimate, out of the surfaces and of how the sensors were held
    assumed                  ///< +z, because there is no surface to tell
  } source = Source::given;  ///< how it is known
  double level_m2 = 0;       ///< of an estimate: area of the surfaces level to it, seen from above or below
  /// Of an estimate: the score of the best direction more than 45° off, over this one's. At 1 the two are
  /// as likely, and the direction should be given.
  double rival = 0;
};

/// "given", "surfaces", "assumed".
const char* name_of(Up::Source source);

/// What the map's parameters give; where they leave it open, up_from_surfaces().
Up up_of(const Map& map);

/// estimate_up() of the map's present snapshot and of how its scans' sensors were held: a depth camera's -y
/// and a lidar's +z are taken to point up. Not while something inserts.
Up up_from_surfaces(const Map& map);

/// The direction that floors, tables and treads say is up.
///
/// 1. A surface is level to a direction if its normal lies within 5° of it or of its opposite: floors are
///    laid better than that, and a ramp for wheelchairs, 1 in 12, still is.
/// 2. Every normal and its opposite are candidates. A candidate's score is the area of the surfaces level to
///    it, those seen from above whole and those seen from below half (normals point to where a surface was
///    seen from, so a floor's points up and a ceiling's down; with any share below 1 the side with floor and
///    tables wins over the one with the ceiling), times 1 − t + t·cos²α for α below 90°, else 1 − t.
/// 3. α is the angle to the mean of the sensors' own up directions, and t nine tenths of that mean's length,
///    which is 1 for a sensor never turned and 0 for one that tumbled or is unknown. So walls, which in a
///    corridor have more area than floor and ceiling, count little where the sensors were held upright; a
///    tenth is left for sensors that are mounted otherwise, such as cameras that look straight down.
/// 4. The best one's level surfaces, each weighted by its area, give the direction.
/// An estimate: on a hillside it is the hill's normal, and without scans (an OctoMap's surfaces) a room with
/// more wall than floor deceives it. Turned with the map. `sensors_up`: that mean, of length at most 1.
/// Cost O(n²) in surfaces, a few ns each.
Up estimate_up(const Snapshot& snapshot, const Eigen::Vector3d& sensors_up = Eigen::Vector3d::Zero());

/// Angle between a surface's normal and up, rad: 0 a floor, π/2 a wall, π a ceiling.
double slope_rad(const Surface& surface, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

/// The rotation of the map frame that brings `up` (not zero) to +z by the shortest way; half a turn about x
/// where it is −z. Identity where it is +z.
Eigen::Quaterniond upright(const Eigen::Vector3d& up);

}  // namespace octosurf
