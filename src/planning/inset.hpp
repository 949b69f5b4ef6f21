#pragma once

#include <optional>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A polygon without the interiors of its edges' reaches, {p + q: p on an edge, q in `kernel`}, and of
/// `besides`; kernel and each of `besides` convex and counter-clockwise, with an area. The kernel contains
/// the origin.
///
/// Every vertex of the polygon and every one of `besides` is perturbed by up to half a µm, pseudo-randomly
/// but reproducibly, so that no three lines meet in a point and none coincide: the caller must allow for
/// that. Empty if the outline still does not close, which takes coordinates closer than a double's precision.
///
/// The result is bounded by parts of few lines: each edge moved by the kernel's farthest corner, and the
/// kernel's sides at convex corners. From each, the parts within the kernel's reach of another edge are cut
/// out, using a grid of the edges; the rest is joined where the same two lines intersect. O(edges · edges
/// within the kernel's reach) at worst; usually only the few within reach of the rest are tested.
///
/// Edges are tested eight at a time, as consecutive ones are close together: a sole on a hall's 9810 rough
/// edges tests 14,000 eights for its 11,200 lines, of which 9,500 remain in part. A quarter of the time is
/// for the edges' reaches, half for testing and cutting, a tenth for the chains. The memory, some 150 bytes
/// an edge (300 for a kernel with 36 sides), stays with the calling thread.
std::optional<std::vector<Polygon>> inset(const Polygon& polygon, const Ring2& kernel,
                                          std::span<const Ring2> besides);

}  // namespace octosurf::planning
