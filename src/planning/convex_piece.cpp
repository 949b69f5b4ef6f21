#include "planning/convex_piece.hpp"

#include <algorithm>

namespace octosurf::planning {

ConvexPiece convex_piece(const Surface& surface, const Ring2& corners) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  ConvexPiece piece;
  piece.A.resize(n, 2);
  piece.b.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector2d& from = corners[static_cast<std::size_t>(i)];
    const Eigen::Vector2d along = (corners[static_cast<std::size_t>((i + 1) % n)] - from).normalized();
    piece.A.row(i) << along.y(), -along.x();
    // The maximum over all vertices, not the edge's own value: rounding never excludes a vertex.
    piece.b[i] = piece.A.row(i).dot(from);
    for (const Eigen::Vector2d& corner : corners)
      piece.b[i] = std::max(piece.b[i], piece.A.row(i).dot(corner));
    piece.vertices.push_back(surface.to_map(from));
  }
  return piece;
}

}  // namespace octosurf::planning
