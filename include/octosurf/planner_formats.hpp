#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <octosurf/contact.hpp>
#include <octosurf/height_grid.hpp>
#include <octosurf/occupancy.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/storeys.hpp>
#include <octosurf/surface.hpp>

// Exports surfaces in the input formats of contact planners; docs/formats.md, section 7, lists the fields.
// The ROS 2 node publishes their messages. All of these planners assume z up: the world is the map turned by
// upright(up) (up.hpp), or the map itself if up is +z.

namespace octosurf {

/// One surface with the allowed positions of a contact's reference point.
struct PlannerSurface {
  SurfaceId id = 0;                                                   ///< in the map
  Eigen::Isometry3d T_world_surface = Eigen::Isometry3d::Identity();  ///< z is the normal
  std::vector<Polygon> polygons;                                      ///< surface frame
  std::vector<Polygon> insets;      ///< surface frame, apart, inside `polygons`: ContactRegion::polygons
  std::vector<ConvexPiece> pieces;  ///< apart; their vertices in the world frame
};

/// Transforms from the map frame to a world rotated by `turn`.
PlannerSurface turned(PlannerSurface surface, const Eigen::Quaterniond& turn);

/// Options of planner_surfaces().
struct PlannerContact {
  /// A quadruped's ball foot of 3 cm, with a placement error of 3 cm.
  ContactShape shape = ContactShape::disc(0.06);
  std::optional<double> yaw_rad;  ///< of the contact; empty: any heading
  ContactLimits limits;           ///< `up` in the map's frame
  std::size_t pieces = 0;         ///< maximum number of convex pieces per surface
  /// Map frame to world: upright(up) (up.hpp).
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
};

/// All surfaces of the snapshot, in its order, each with its contact_region() and, if requested, that
/// region's convex_pieces(). Surfaces too small for the contact have no insets. `octree` is used as by
/// contact_region(), and may be null if the limits do not need it. Throws as these two do; costs the same.
std::vector<PlannerSurface> planner_surfaces(const Snapshot& snapshot, const PlannerContact& contact,
                                             const OccupancyView* octree = nullptr);

/// A folder for Nav2 (docs/formats.md, section 7): `storey_0.pgm` with `storey_0.yaml` and so on, and
/// `route.geojson`, unless the route has no edges: route_server refuses such files. `route` and `stairs` are
/// those of the storeys, `frame` is the frame id of the route's nodes, `stair_operation` the operation of the
/// route server where a stair is entered and left; empty: none.
///
/// The folder is complete or absent. An existing one is replaced, with `force`, and only if it contains
/// nothing but such files. Throws Error(usage), Error(data) for numbers that are not finite or if there is
/// nothing to write, Error(output).
void export_nav2(const std::vector<Storey>& storeys, const StoreyRoute& route,
                 const std::vector<Stair>& stairs, const std::string& frame,
                 const std::filesystem::path& folder, bool force = false,
                 const std::string& stair_operation = {});

}  // namespace octosurf
