#pragma once

#include <initializer_list>
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

/// Blocks a contact's middle: wherever the obstacles meet its mirrored shape, `kernel`
/// (convex, counter-clockwise).
struct KeptOff {
  Ring2 kernel;
  std::span<const Polygon> obstacles;
};

/// The places in `polygon` from which `kernel` (convex, counter-clockwise) does not meet its edges, without
/// the interiors of `blocked` (convex, counter-clockwise) and what `off` keeps off. On a grid of 1 µm, for
/// any coincidences. By convolution of the outlines with the kernels (Guibas, Ramshaw and Stolfi 1983): a
/// place is free where the curve of the edges, which turns about it once for the polygon and back once for
/// each part of its outside within the kernel, still turns about it. O(n log n), some 5 µs for each edge.
/// Throws Error(usage) for coordinates beyond 2 km.
std::vector<Polygon> inset(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> blocked = {},
                           std::initializer_list<KeptOff> off = {});

/// The union of `polygons` and `added`, without the interiors of `removed`.
std::vector<Polygon> reshaped(std::span<const Polygon> polygons, std::span<const Ring2> added,
                              std::span<const Ring2> removed);

}  // namespace octosurf::planning
