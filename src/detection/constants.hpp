#pragma once

#include <cstddef>

namespace octosurf::detection {

/// What decides about planes beside the readings' own noise (sensing::ReadingModel) and the map's parameters:
/// docs/detection.md has the formulas they stand in. What only saves effort stands where it does.
struct Constants {
  /// Nats for each pair of neighbouring voxels that the rim between two planes would part: the prior that
  /// surfaces are wholes (Potts). Tuned: half of it cuts noisy walls up, twice as much changes nothing.
  static constexpr double rim_cost = 0.5;
  /// How many times as large as what can be told apart the difference of two planes may be, ln 100: 1 mm to
  /// 10 cm, or 0.5° to a right angle.
  static constexpr double log_scales = 4.605170185988092;
  /// Nats: places looked at for a plane; one in 10⁴ of those that hold none may seem to hold one.
  static constexpr double log_places = 9;
  /// Share of a patch's readings up to which another may be its tail: of two halves of a wall none is the
  /// other's noise.
  static constexpr double largest_tail = 0.25;
  /// rad. Feet stand on what turns by less: at its ends the normal is off by 6°, half of what shoes give way.
  static constexpr double least_turn = 0.2;
  /// Readings: a plane's three parameters, and two that can contradict.
  static constexpr std::size_t fewest_of_plane = 5;
  /// m, of the smallest blocks in which planes are looked for: what a foot's edge needs.
  static constexpr double smallest_edge = 0.08;
  /// Standard deviations of a surface's plane within which a point must fit every plane: 95 % of them.
  static constexpr double plane_deviations = 2;
  /// Of 20°. Two planes at less than 20° part so slowly that most of what lies near their edge would be of
  /// both.
  static constexpr double cos_nearly_parallel = 0.93969262078590838;
  /// Of 60°. Planes that differ by more are never one, and heights over a frame between them make little
  /// sense.
  static constexpr double least_cosine = 0.5;
  /// The share of a surface's inliers in the blocks of what is looked at, from which on all are labelled:
  /// most of its inliers lie around new points, so it is as open as they are.
  static constexpr double share_for_whole = 0.5;
};

}  // namespace octosurf::detection
