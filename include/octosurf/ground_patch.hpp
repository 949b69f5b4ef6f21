#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <octosurf/ground.hpp>

namespace octosurf {

/// The places of a patch, and the robot that reads it.
struct PatchLayout {
  /// x forward, y to the left of the base's origin, m: horizontal, turned by the base's yaw only.
  std::vector<Eigen::Vector2d> points;
  double max_step_m = 0.3;  ///< between neighbouring places of one storey
  double headroom_m = 1;    ///< obstacles higher above the ground are ignored
  /// Places without a height get that of the nearest place with one.
  bool fill = false;

  /// The middles of square cells, x ascending and for each x all y ascending, as learned policies flatten
  /// their grids; `center` is the grid's. By default 32 × 20 cells.
  static PatchLayout grid(double length_m = 1.6, double width_m = 1, double cell_m = 0.05,
                          const Eigen::Vector2d& center = Eigen::Vector2d::Zero());
};

/// Content of a place of a patch.
enum class PatchCell : std::uint8_t {
  unseen,     ///< no reading decides
  supported,  ///< ground of the robot's storey, clear up to the headroom
  occupied,   ///< something higher than a step, or hanging lower than the headroom
  below       ///< a void or a drop, or less than a voxel from one: the ground is open, or lower than a step
};
/// By PatchCell.
inline constexpr std::array<std::string_view, 4> patch_cell_names{"unseen", "supported", "occupied", "below"};

/// The ground around a robot; each vector has a value for each place of the layout, in its order. NaN where
/// it is unknown.
struct GroundPatch {
  /// m, along up from the base's origin: of a surface's plane where one is the ground, else of the topmost
  /// reading below the headroom. In a void: of what lies there, NaN if nothing was seen.
  std::vector<float> height;
  std::vector<PatchCell> cell;   ///< what is there
  std::vector<float> slope_rad;  ///< of the surface, NaN without one
  /// m, to the nearest place where the ground ends or a step begins, to half a cell of 5 cm; at most
  /// Foothold::farthest_margin_m. Only ends within 10 cm of the points' bounding box count. 0 at places
  /// that are not supported.
  std::vector<float> edge_m;
};

/// The ground around a robot at `T_map_base`, as a controller reads it at every step.
///
/// The robot's storey is what a flood reaches from under the base, by steps of at most max_step_m from one
/// place of a grid of 5 cm to the next; beyond voids, obstacles and unseen places it goes on at the height
/// that it had before them, and up to the headroom above the base. So a table above the headroom, a ceiling
/// and the storey above are not ground. A place is supported by a surface with a
/// reading nearer than half the widest unseen gap of the view's rules; where readings are far apart, or end,
/// the surface's ground decides on voids (gaps.hpp).
///
/// `view` gives map, up, slope and widest gap. Throws Error(usage) for a pose that is not rigid, no points,
/// points that are not finite or farther than 5 m from the base, and a step that is not in (0, 1] m
/// or a headroom that is not between it and 5 m.
/// O(occupied voxels around the points), 0.5 to 1 ms for 640 in a map of 2 cm, and a tile of the ground, some
/// ms, where one is asked first after a change. Any thread.
GroundPatch ground_patch(const GroundView& view, const Eigen::Isometry3d& T_map_base,
                         const PatchLayout& layout = PatchLayout::grid());

}  // namespace octosurf
