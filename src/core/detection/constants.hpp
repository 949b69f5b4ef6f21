#pragma once

#include <cstddef>

namespace octosurf::detection {

/// Decision thresholds for planes, besides the readings' noise (sensing::ReadingModel) and the map's
/// parameters; docs/detection.md has the formulas. Constants that only limit effort are beside their use.
struct Constants {
  /// Nats for each pair of neighbouring voxels separated by a boundary between two planes: a Potts prior for
  /// connected surfaces. Tuned: half of it fragments noisy walls, twice as much changes nothing.
  static constexpr double boundary_cost = 0.5;
  /// Range of scales of the difference between two planes, from the smallest detectable to 100 times that, ln
  /// 100: 1 mm to 10 cm, or 0.5° to a right angle.
  static constexpr double log_scales = 4.605170185988092;
  /// Nats: number of places searched for a plane; allows a false plane in one of 10⁴ places without one.
  static constexpr double log_places = 9;
  /// Largest share of a patch's readings that another patch may have to count as its noise tail: one half of
  /// a wall is never noise of the other.
  static constexpr double largest_tail = 0.25;
  /// rad. Feet tolerate surfaces that turn by less: at their ends the normal is off by 6°, half of a shoe's
  /// compliance.
  static constexpr double least_turn = 0.2;
  /// Readings: three for a plane's parameters, and two to contradict it.
  static constexpr std::size_t fewest_of_plane = 5;
  /// Times that a surface of the fewest points, n, is looked at while it comes into view. Tuned on thirteen
  /// recordings: at every five points 507 of 548 faces and 32 false surfaces, at eight looks 504 and 28, at
  /// five 503 and 26 in 0.7 of the time; with four, rungs of ladders are lost.
  static constexpr std::size_t looks = 5;
  /// m, of the smallest blocks searched for planes: the smallest edge that a foot needs.
  static constexpr double smallest_edge = 0.08;
  /// Standard deviations of a surface's plane within which a point must fit every plane: 95 % of them.
  static constexpr double plane_deviations = 2;
  /// Of 20°. Two planes at less than 20° diverge so slowly that most points near their edge fit both.
  static constexpr double cos_nearly_parallel = 0.93969262078590838;
  /// Of 60°. Planes that differ by more are never merged, and heights over a common frame become meaningless.
  static constexpr double least_cosine = 0.5;
};

}  // namespace octosurf::detection
