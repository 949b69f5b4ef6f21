#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace octosurf::geometry {

/// Local width of a plane's points: the median over at most `most` evenly chosen points of the width (as
/// width_of()) of the points within 1.5 `width`. The total extent can be misleading: a ladder's front is as
/// wide as its rungs are long, but nowhere much wider than a rung.
///
/// 1. The factor 1.5: at the corner of a large surface, a quarter of a disc, points vary as those of a strip
///    of 0.76 times the radius do, so corners do not count as narrow.
/// 2. Points are means of readings over cells of `spacing`, which vary by up to spacing²/12 more across.
/// 3. Points no wider than `spacing` may be a single scan line over something wide, and are not counted as
///    narrow.
/// 4. `spread`: of each point, if given, how far it may lie off either way. With time points fill all of
///    that; a third of its square is their variance, and no width.
/// 5. `along`: of the points around one, those count that lie no farther from it in the direction in which
///    they extend most. So a line has no width where it bends.
///
/// Empty if most are so, and if `width` is no more than `spacing`. Cost: O(n log n), and the neighbours of
/// each evaluated point.
std::optional<double> median_local_width(std::span<const Eigen::Vector2d> points, double width,
                                         double spacing, std::size_t most = 400,
                                         std::span<const Eigen::Vector2d> spread = {},
                                         double along = std::numeric_limits<double>::infinity());

}  // namespace octosurf::geometry
