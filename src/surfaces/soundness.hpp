#pragma once

#include "surfaces/changes.hpp"

#include <span>

namespace octosurf {

/// What is asked of points before they are called one surface, and again when a surface has changed.

/// Noise of a wall lies in front of or behind it as a parallel sheet: most of `points` lie over a
/// larger surface, within the reach of its noise: that one's id, else 0. `self`: the surface they belong
/// to, 0 if none.
SurfaceId parallel_sheet(Workspace& work, std::span<const Workspace::Index> points, const Plane& plane,
                         SurfaceId self);

/// Plane through points, weighted by 1/σ²; normal on the side of `toward`'s.
Plane fitted(Workspace& work, std::span<const Workspace::Index> points, const Plane& toward);

}  // namespace octosurf
