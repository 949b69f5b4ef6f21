#pragma once

#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The convex piece of a surface with these counter-clockwise corners. Each corner satisfies A·(u, v) ≤ b.
ConvexPiece convex_piece(const Surface& surface, const Ring2& corners);

}  // namespace octosurf::planning
