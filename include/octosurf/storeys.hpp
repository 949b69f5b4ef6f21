#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include <octosurf/footsteps.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/ids.hpp>

namespace octosurf {

/// The robot that a storey's grid is for, and what a storey is.
struct StoreyLimits {
  double radius_m = 0.3;    ///< of the circle about its footprint
  double headroom_m = 1.6;  ///< obstacles higher above the ground are ignored
  /// m, between neighbouring places of one storey. Below the least riser that building codes allow (0.10 m,
  /// International Building Code 1011.5.2) by a voxel of 2 cm, to which heights of pieces of ground are
  /// known.
  double max_step_m = 0.08;
  double cell_m = 0.05;  ///< edge of a cell, as Nav2's costmaps have it
  /// m², free ground of a storey to which no stair leads. Tables are smaller (one for eight people has 2.9
  /// m²), rooms are larger (6.5 m² at least, International Residential Code R304).
  double min_area_m2 = 4;
  /// From the map frame to the grids', whose z is up: upright(up) (up.hpp).
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();

  /// Of a robot's body: the circle about it, and its height.
  static StoreyLimits of(const Robot& robot);
};

/// State of a storey's cell.
enum class StoreyCell : std::uint8_t {
  unknown,  ///< nothing was seen there at the storey's height
  free,     ///< ground that the robot can cover
  occupied  ///< an obstacle, a void or a drop, or too narrow between these
};

/// Ground that a robot can go about on without a stair, as a grid of square cells. Places are in the grids'
/// frame: the map's, turned by StoreyLimits::turn.
struct Storey {
  double cell_m = 0;                                 ///< edge of a cell
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< lowest corner of cell 0, a multiple of the edge
  std::size_t columns = 0;                           ///< cells along x
  std::size_t rows = 0;                              ///< along y
  std::vector<StoreyCell> cells;                     ///< x ascending and row by row, y ascending
  std::vector<float> elevation;                      ///< m, of the storey's ground in each cell, else NaN
  double height_m = 0;                               ///< median elevation
  double area_m2 = 0;                                ///< free
  std::vector<SurfaceId> surfaces;                   ///< that it is made of, ascending
  /// The storeys, by index, in whose grids the ground continues, and the widest place of each seam, on this
  /// storey's ground.
  std::map<std::size_t, Eigen::Vector3d> seams;

  /// The middle of a cell: x, y.
  Eigen::Vector2d center_of(std::size_t cell) const {
    const std::size_t row = cell / columns, column = cell % columns;
    return origin +
           cell_m * Eigen::Vector2d(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
  }
  /// The cell that holds a point; empty outside the grid.
  std::optional<std::size_t> cell_at(const Eigen::Vector2d& point) const;
};

/// The storeys of a place, lowest first.
///
/// 1. Ground is what level surfaces support, without voids and wide unseen gaps (GroundView::solid()), by the
///    slope of the view's rules; treads of its stairs are left out. Neighbouring cells are connected where
///    both planes lie at most max_step_m apart at their border: a ramp is no step. Obstacles on the ground do
///    not divide a storey.
/// 2. No grid has two heights in a cell: where connected ground passes over itself, as ramps of a car park,
///    it is split. A storey is filled like a basin, from its lowest cell up; ground over a cell that it has
///    begins another storey, and both have a seam.
/// 3. A storey is what holds a landing of a stair, the largest ground of the map, and other ground with at
///    least min_area_m2 free. So a table is none, and a stage of 5 m² is one although nothing leads up.
/// 4. Free is ground with nothing from max_step_m to headroom_m above it, unless it is too narrow: no disc of
///    radius_m that touches nothing occupied comes near it (√2 radii from its middle, so that corners of
///    rooms stay). It is not shrunk by the radius: costmaps inflate. A thing of no surface is an obstacle
///    from 1.5 voxels up; unknown space above the ground counts as clear.
/// 5. Occupied: something read there, to the headroom; a void or a drop, anywhere in the cell; ground too
///    narrow. Voids and drops are known where a ray passed. Cells beside the ground are judged at the height
///    of the nearest ground. Everything else is unknown.
///
/// Throws Error(usage) for limits out of range, and for more than 2²⁴ cells. O(area of level surfaces /
/// cell²) and O(occupied voxels), 0.2 s for two floors of 40 m² at 3 cm, and what the view's ground costs.
std::vector<Storey> find_storeys(const GroundView& view, const StoreyLimits& limits = {});

/// What a place of a route is.
enum class RoutePlace {
  landing,  ///< before or behind a stair
  seam,     ///< where ground continues in another storey's grid
  way       ///< a corner on the way from one of these to another
};
/// By RoutePlace.
inline constexpr std::array<std::string_view, 3> route_place_names{"landing", "seam", "way"};

/// A place of a route, where the middle of the robot may be.
struct RouteNode {
  RoutePlace place = RoutePlace::way;            ///< what it is
  std::size_t storey = 0;                        ///< index
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< grids' frame, on the ground
};

/// A way from one place of a route straight to another.
struct RouteEdge {
  std::size_t from = 0;                       ///< index of a node
  std::size_t to = 0;                         ///< likewise
  double length_m = 0;                        ///< of a stair along its edges; at least a cell
  std::optional<std::size_t> stair{};         ///< index in GroundView::stairs(); empty: over free ground
  bool up = false;                            ///< of a stair: from below
  double heading_rad = 0;                     ///< of a stair: in which it is entered, as yaw in contact.hpp
  std::vector<Eigen::Vector3d> over_stair{};  ///< middles of its edges, in order
};

/// The storeys' stairs and the ways between them, as a graph.
struct StoreyRoute {
  std::vector<RouteNode> nodes;              ///< landings and seams first
  std::vector<RouteEdge> edges;              ///< both directions of each way are edges
  std::vector<std::size_t> without_landing;  ///< stairs of which an end was not found in any storey
};

/// The graph of storeys found in `view` by the same limits. Landings and seams of one storey are connected by
/// the shortest way over its free cells on which the robot's disc touches nothing, cut short at corners:
/// every edge over ground is straight and clear. Throws as find_storeys(). O(cells) for each landing, some
/// 10 ms.
StoreyRoute find_route(const GroundView& view, const std::vector<Storey>& storeys,
                       const StoreyLimits& limits = {});

}  // namespace octosurf
