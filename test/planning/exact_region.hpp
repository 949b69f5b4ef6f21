#pragma once

#include "support/testing.hpp"

#include <octosurf/surface.hpp>

namespace octosurf::test {

/// Where the reference point of a convex contact may be on polygons: everything else, edge by edge, cut out
/// in exact arithmetic. Slow and obvious.
class ExactRegion {
 public:
  /// `contact` about its reference point, turned as it stands on the surface.
  ExactRegion(const std::vector<Polygon>& polygons, const Ring2& contact);

  double area() const;
  /// Not a point of `polygons` is outside.
  bool covers(const std::vector<Polygon>& polygons) const;

 private:
  struct Set;
  std::shared_ptr<const Set> set_;
};

/// In one, not in the other, m²: exactly, but for the sum.
double exact_difference(const std::vector<Polygon>& a, const std::vector<Polygon>& b);

/// No two of the rings overlap, and none leaves the polygons: exactly.
bool disjoint(const std::vector<Ring2>& rings);
bool inside_of(const std::vector<Ring2>& rings, const std::vector<Polygon>& polygons);

}  // namespace octosurf::test
