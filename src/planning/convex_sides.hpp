#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// A convex polygon (counter-clockwise; possibly a point or a segment) as an intersection of half planes.
class ConvexSides {
 public:
  explicit ConvexSides(const Ring2& ring);

  const Eigen::AlignedBox2d& box() const { return box_; }
  double area() const { return area_; }

  /// Depth of a point: its distance from the nearest side; negative if it is outside.
  double depth(const Eigen::Vector2d& point) const;
  /// The depth of a segment's deepest point. O(sides), a few ns each.
  double depth(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

  /// Distance between the polygon and a segment; 0 if they meet.
  double distance(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const;

  /// Signed area of its part enclosed by a ring. O(vertices), of those near it sides times as much.
  double area_within(const Ring2& ring) const;

 private:
  struct Side {
    Eigen::Vector2d normal;  // outward, unit
    double offset = 0;
  };
  /// Height of one side's plane over a segment: value + slope · t.
  struct Line {
    double value = 0, slope = 0;
  };
  Line lowest_at(const Eigen::Vector2d& from, const Eigen::Vector2d& along, double t) const;
  unsigned beyond(const Eigen::Vector2d& point) const;

  Ring2 ring_;
  std::vector<Side> sides_;
  Eigen::AlignedBox2d box_;
  double area_ = 0;
};

/// Signed, positive if counter-clockwise.
double area_of(const Ring2& ring);
double area_of(const std::vector<Polygon>& polygons);

}  // namespace octosurf::planning
