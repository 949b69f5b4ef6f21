#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// Where one level surface rises above another at a straight front edge.
struct Step {
  SurfaceId lower = 0;     ///< surface before the edge; of several side by side, that of its widest part
  SurfaceId upper = 0;     ///< surface that the edge bounds, likewise
  double riser_m = 0;      ///< height that a foot climbs at the edge's middle, along up
  double width_m = 0;      ///< length of the edge
  double heading_rad = 0;  ///< when climbing, about up, as yaw in contact.hpp
  std::array<Eigen::Vector3d, 2> edge{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  ///< left, right end
  friend bool operator==(const Step&, const Step&) = default;
};

/// Course of a stair.
enum class StairKind {
  straight,  ///< one heading; landings between its flights may be on the way
  turning,   ///< turns at a landing or over winders
  spiral     ///< turns on every tread, always to the same side
};
/// By StairKind.
inline constexpr std::array<std::string_view, 3> stair_kind_names{"straight", "turning", "spiral"};

/// Mean and standard deviation of a length, m.
struct MeanLength {
  double mean_m = 0;  ///< mean
  double std_m = 0;   ///< standard deviation over the stair
};

/// Level surfaces that rise by nearly equal steps, each beginning where the one before ends.
struct Stair {
  /// Id of the oldest surface among treads and those merged into them: the same after more scans and after a
  /// restart, unless an older surface turns out to be a tread.
  SurfaceId id = 0;
  StairKind kind = StairKind::straight;  ///< course
  std::vector<Step> steps;               ///< from below, at least two; `steps.size()` counts the risers
  /// From below, landings between flights included; a tread that was mapped in parts has several.
  std::vector<SurfaceId> treads;
  SurfaceId landing_below = 0;  ///< larger surface at the lower end; 0: not seen
  SurfaceId landing_above = 0;  ///< likewise at the upper end
  MeanLength riser;             ///< of all steps
  MeanLength tread;             ///< front edge to next front edge, between their middles; landings left out
  double width_m = 0;           ///< median of the edges'
  double heading_rad = 0;       ///< straight: of the flights; else of the lowest step
  double turn_rad = 0;          ///< from the lowest to the highest step's heading, counter-clockwise
};

/// Result of find_stairs().
struct Stairs {
  std::vector<Stair> stairs;       ///< ascending id
  std::vector<Step> single_steps;  ///< of no stair, such as kerbs; by upper, then lower surface
};

/// Finds stairs from the heights and outlines of level surfaces alone, so open stairs count too.
///
/// 1. Level: at most 10° from level and seen from above.
/// 2. A step: at least 0.3 m of a surface's edge has a surface 0.10 m before it that lies 0.05 to 0.30 m
///    lower. One straight below (shelves) is not before it. In stairs of three risers and more up to 0.25 m
///    before it may be unseen, as the backs of treads are from below.
///    Edges in one line, less than 0.10 m apart and alike in height within 25 mm, are parts of one. Its
///    riser is measured where feet stand: 0.125 m to either side, or at a shallower tread's middle.
/// 3. A stair: two steps or more, risers within 25 mm of each other, edges one behind the other by 0.15 to
///    0.60 m, facing alike within 50°. Two steps alone count with risers within 10 mm and treads parallel
///    within 3°. Flights of two steps or more that share a landing are one stair.
/// Some µs for each 4 cm of outline. Throws Error(usage) for a direction that is zero or not finite.
Stairs find_stairs(const Snapshot& snapshot, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

/// The stair whose tread is nearest to a point; nullptr without stairs. `stairs` are those of
/// the snapshot.
const Stair* nearest_stair(const Snapshot& snapshot, const std::vector<Stair>& stairs,
                           const Eigen::Vector3d& point);

}  // namespace octosurf
