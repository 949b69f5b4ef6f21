#pragma once

#include "surfaces/scan_changes.hpp"

#include <span>

namespace octosurf {

/// What is asked of points before they are called one surface, and again when a surface has changed.

/// Which of `points` lie over one larger surface that faces the same way, within the reach of its noise
/// and of poses that drift between visits. Who sees one of the two would see it through the other: they
/// cannot both be there, and the larger one is believed.
struct Sheet {
  SurfaceId over = 0;  ///< the larger surface; 0: none
  std::vector<Workspace::Index> points;
  bool covers_much_of(std::size_t all) const { return points.size() * 10 > all * 4; }
};
/// The larger surface that most of the points lie over. `self`: what they belong to, 0 if to none.
Sheet sheet_of(Workspace& work, std::span<const Workspace::Index> points, const Plane& plane, SurfaceId self);
/// So many of the points are such noise that they are no surface of their own.
SurfaceId parallel_sheet(Workspace& work, std::span<const Workspace::Index> points, const Plane& plane,
                         SurfaceId self);

/// Plane through points, weighted by 1/σ²; normal on the side of `toward`'s.
Plane fitted(Workspace& work, std::span<const Workspace::Index> points, const Plane& toward);

}  // namespace octosurf
