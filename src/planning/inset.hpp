#pragma once

#include <optional>
#include <span>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A polygon without the interiors of what lies about its edges, {p + q: p on an edge, q in `kernel`}, nor of
/// `besides`; kernel and each of `besides` convex and counter-clockwise, with an area. The kernel holds the
/// origin.
///
/// Every vertex of the polygon and every one of `besides` is moved by up to half a µm, by chance (but always
/// the same), so that no three lines meet in a point and none coincide: the caller leaves room for that.
/// Nothing if the outline found is not closed all the same, which takes coordinates that differ by less than
/// doubles tell apart.
///
/// What is left is bounded by parts of few lines: each edge moved by the kernel's farthest corner, and the
/// kernel's sides about corners that stick out. Of each, what lies within the kernel's reach of another edge
/// is cut out, by a grid of the edges; what remains is put together where the same two lines cut each other.
/// O(edges · edges within the kernel's reach) at worst; mostly the few within reach of what is left are
/// tested.
///
/// Edges are tested eight at a time, since those that follow one another lie together: a sole on a hall's
/// 9810 rough edges tests 14,000 eights for its 11,200 lines, of which 9,500 are left in part. A quarter of
/// the time goes into the edges' reaches, half into testing and cutting, a tenth into the chains. The memory
/// for it, some 150 bytes an edge (300 for a kernel with 36 sides), stays with the calling thread.
std::optional<std::vector<Polygon>> inset(const Polygon& polygon, const Ring2& kernel,
                                          std::span<const Ring2> besides);

}  // namespace octosurf::planning
