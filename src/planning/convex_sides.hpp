#pragma once

#include <Eigen/Core>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A convex polygon (counter-clockwise; possibly a point or a segment) as an intersection of half planes.
class ConvexSides {
 public:
  explicit ConvexSides(const Ring2& ring);

  /// Depth of a point: its distance from the nearest side; negative if it is outside.
  double depth(const Eigen::Vector2d& point) const;

 private:
  struct Side {
    Eigen::Vector2d normal;  // outward, unit
    double offset = 0;
  };
  std::vector<Side> sides_;
};

/// Signed, positive if counter-clockwise.
double area_of(const Ring2& ring);
double area_of(const std::vector<Polygon>& polygons);

}  // namespace octosurf::planning
