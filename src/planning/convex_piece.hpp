#pragma once

#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The piece with these corners, convex and counter-clockwise, of a surface. Each corner satisfies A·(u, v) ≤
/// b.
ConvexPiece convex_piece(const Surface& surface, const Ring2& corners);

}  // namespace octosurf::planning
