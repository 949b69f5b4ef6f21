#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf {

/// A convex part of a surface.
struct ConvexPiece {
  std::vector<Eigen::Vector3d> vertices;  ///< map frame, counter-clockwise seen from the normal's tip
  /// The same part as A·(u, v) ≤ b in the surface's frame; rows of unit length, one per edge.
  Eigen::Matrix<double, Eigen::Dynamic, 2> A;
  Eigen::VectorXd b;  ///< see A; m
};

/// At most `most` disjoint convex pieces inside polygons of a surface, its own or a ContactRegion's, largest
/// first, covering as much of their area as possible: few large pieces, as mixed-integer planners need them.
/// Each is grown to the largest found in what the others left (IRIS, Deits and Tedrake 2014). Pieces below
/// `min_area_m2` are omitted, as are those that together would add less than 2 % to the area, and, except for
/// the first, those narrower than d/4. Twenty cover 98 % of the outlines of maps/office, and 85 % of the one
/// they cover least.
///
/// 1. Each piece lies in the polygons, and no two overlap (checked in exact arithmetic).
/// 2. Every vertex of a piece satisfies its A·(u, v) ≤ b.
/// 3. Polygons are independent: a change in one leaves the others' pieces unchanged bit by bit, though their
///    number may change. Within a polygon, a change to its largest piece may change all.
/// Throws Error(data) if a coordinate is not finite, Error(usage) beyond 2 km. Some ms; O(corners) for each
/// of some dozen trials a piece.
std::vector<ConvexPiece> convex_pieces(const Surface& surface, const std::vector<Polygon>& polygons,
                                       std::size_t most = 20, double min_area_m2 = 0);

}  // namespace octosurf
