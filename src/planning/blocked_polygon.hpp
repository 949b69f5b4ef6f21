#pragma once

#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The union of `polygons` and `added`, without the interiors of `removed` (convex, counter-clockwise), on a
/// grid of 1 µm, in exact integer arithmetic, for any coincidences. O(n log n) in edges and their crossings,
/// some µs each. Throws Error(usage) for coordinates beyond 2 km.
std::vector<Polygon> reshaped(std::span<const Polygon> polygons, std::span<const Ring2> added,
                              std::span<const Ring2> removed);

}  // namespace octosurf::planning
