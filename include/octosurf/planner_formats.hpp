#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/height_grid.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

// Surfaces in the formats that contact planners read already. docs/formats.md, section 7, has them field by
// field. All of these planners take z for up: the world is the map turned by upright(up) (up.hpp), and the
// map itself where up is +z.
//
// Files and folders are complete or not there. All throw Error(usage) for something that exists without
// `force`, Error(data) for numbers that are not finite or if there is nothing to write, Error(output) if it
// cannot be written. A folder is replaced, not added to, and only if it holds nothing but files of its
// format.

namespace octosurf {

/// One surface, and where on it a contact's reference point may be.
struct PlannerSurface {
  SurfaceId id = 0;                                                   ///< in the map
  Eigen::Isometry3d T_world_surface = Eigen::Isometry3d::Identity();  ///< z is the normal
  std::vector<Polygon> polygons;                                      ///< surface frame
  std::vector<Polygon> insets;      ///< surface frame, apart, inside `polygons`: ContactRegion::polygons
  std::vector<ConvexPiece> pieces;  ///< apart; their vertices in the world frame
};

/// From the map's frame to a world that is turned by `turn` against it.
PlannerSurface turned(PlannerSurface surface, const Eigen::Quaterniond& turn);

/// What planner_surfaces() takes.
struct PlannerContact {
  /// A quadruped's ball foot of 3 cm, placed to 3 cm.
  ContactShape shape = ContactShape::disc(0.06);
  std::optional<double> yaw_rad;  ///< of the contact; empty: any heading
  ContactLimits limits;           ///< `up` in the map's frame
  std::size_t pieces = 0;         ///< at most so many convex pieces of each surface's region
  /// From the map's frame to the world's: upright(up) (up.hpp).
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
};

/// All surfaces of the snapshot, in its order, each with its contact_region() and, if they are asked for,
/// that region's convex_pieces(). Surfaces without room for the contact have no insets. `octree` is asked as
/// by contact_region(), and may be null if the limits do not need it. Throws as these two do; costs what they
/// do.
std::vector<PlannerSurface> planner_surfaces(const Snapshot& snapshot, const PlannerContact& contact,
                                             const OccupancyView* octree = nullptr);

/// SL1M and its kin: a JSON list of the pieces, `{"id", "vertices", "normal", "A", "b"}` each.
///
/// 1. Vertices counter-clockwise seen from the normal's tip, and so that the first three make the largest
///    triangle that three in a row make: SL1M computes the normal from these.
/// 2. A·p ≤ b, rows of unit length in world coordinates: an edge each, from the first vertex on, then n and
///    −n, as SL1M's own. Every vertex satisfies them to 2e-9. They also hold where SL1M's do not: on surfaces
///    tilted by more than 8° and on those whose normal points down.
void export_sl1m(const std::vector<PlannerSurface>& surfaces, const std::filesystem::path& file,
                 bool force = false);

/// What a planar terrain left out.
struct PlanarTerrainCount {
  std::size_t regions = 0;        ///< written
  std::size_t without_inset = 0;  ///< polygons on which no contact finds room
  std::size_t too_steep = 0;      ///< polygons steeper than 80°, by whose n_z readers divide
};

/// `convex_plane_decomposition_msgs/PlanarTerrain`, which ocs2's and legged_control's perceptive planners
/// read: JSON or, by the ending .cdr, as ROS 2 serialises it (XCDR1, little-endian, with the encapsulation
/// header).
///
/// 1. A region for each polygon that has an inset; its insets lie in its boundary.
/// 2. `frame` is the grid map's frame id, and so the regions'.
/// 3. The grid map has the layers `elevation`, in which gaps hold the lowest height on their rim (readers
///    build a distance field of it and know no gaps), and `smooth_planar`, its mean over 0.2 m.
PlanarTerrainCount export_planar_terrain(const std::vector<PlannerSurface>& surfaces, const HeightGrid& grid,
                                         const std::string& frame, const std::filesystem::path& file,
                                         bool force = false);

/// `grid_map_msgs/GridMap` with the layers `elevation`, `normal_x`, `normal_y`, `normal_z` and `surface_id`:
/// JSON (null where there is nothing) or .cdr (NaN).
void export_grid_map(const HeightGrid& grid, const std::string& frame, const std::filesystem::path& file,
                     bool force = false);

/// A picture of heights, 16-bit grey PNG, and `file` with the ending .json that says what they mean: height =
/// offset + scale · value, 0 where there is nothing; row 0 is the largest y, column 0 the smallest x.
void export_height_image(const HeightGrid& grid, const std::filesystem::path& file, bool force = false);

}  // namespace octosurf
