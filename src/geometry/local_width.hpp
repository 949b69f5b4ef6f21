#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

namespace octosurf::geometry {

/// How wide what was read of a plane is where it lies: the median over at most `most` of the points, evenly
/// chosen, of the width (as width_of()) of those within 1.5 `width`. The extent of all does not say that: a
/// ladder's front is as wide as its rungs are long, and nowhere much wider than a rung.
///
/// 1. So far, because around the corner of something large, a quarter of a disc, points vary as those of a
///    strip of 0.76 times the radius do: nothing is taken for narrow where it ends.
/// 2. Points are means of readings over cells of `spacing`, which vary by up to spacing²/12 more across.
/// 3. Where points look no wider than `spacing` they may be a sensor's only line over something wide, and
///    count as that.
///
/// Empty if most are so, and if `width` is no more than `spacing`. Cost: O(n log n), and the points near each
/// of those that are looked at.
std::optional<double> median_local_width(std::span<const Eigen::Vector2d> points, double width,
                                         double spacing, std::size_t most = 400);

}  // namespace octosurf::geometry
