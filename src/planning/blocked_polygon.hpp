#pragma once

#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// By how much a blocking polygon must be enlarged so that remaining() excludes all of it: corners are
/// rounded to the grid of 1 µm on input and again wherever edges cross.
inline constexpr double grid_slack = 4e-6;

/// `polygon` without the interiors of convex polygons (counter-clockwise), on a grid of 1 µm, in exact
/// integer arithmetic, for any coincidences. O(n log n) in edges and their crossings, some µs each. Throws
/// Error(usage) for coordinates beyond 2 km.
std::vector<Polygon> remaining(const Polygon& polygon, std::span<const Ring2> blocked);

/// Likewise the union of `polygons` and `added`, without the interiors of `removed`.
std::vector<Polygon> reshaped(std::span<const Polygon> polygons, std::span<const Ring2> added,
                              std::span<const Ring2> removed);

}  // namespace octosurf::planning
