#pragma once

#include "cylinders/normal_field.hpp"

#include <algorithm>
#include <span>
#include <vector>

namespace octosurf::cylinders {

/// Membership of points in a cylinder, and the criteria for reporting one.
class CylinderRules {
 public:
  /// 37° between normal and the direction off the axis: normals of thin rails are smoothed over the bend.
  static constexpr double cos_facing = 0.8;

  explicit CylinderRules(const surfaces::MapView& map);

  std::size_t min_points() const { return min_points_; }  ///< inliers: n
  double min_radius() const { return min_radius_; }       ///< m
  double max_radius() const { return 0.5; }               ///< m
  double tolerance(PointId i) const { return map_.noise.tolerance(map_.window[i].range_class); }
  /// Tolerance of a point, at most an eighth of the radius, if that is over s: a less certain point cannot
  /// constrain a cylinder of radius r.
  double tolerance(const geometry::CylinderShape& shape, PointId i) const {
    return std::min(tolerance(i), std::max(map_.parameters.surface_tolerance(), shape.radius / 8));
  }

  const LocalPlane& local_plane(PointId i) const { return normals_.at(i); }

  /// Within its tolerance of the lateral surface and, if its normal is known, facing away from the axis; if
  /// not, within half of it.
  bool fits(const geometry::CylinderShape& shape, PointId i);

  geometry::CylinderSample sample(PointId i);
  /// Of every `stride`-th.
  std::vector<geometry::CylinderSample> samples(std::span<const PointId> points, std::size_t stride);
  /// Stride for about `most` points, which determine a shape as well as all do.
  static std::size_t stride(std::size_t points, std::size_t most) { return points / most + 1; }

  /// Whether it could become convincing once fitted to all of its points; eliminates most shapes in clutter.
  bool promising(const geometry::CylinderShape& shape,
                 std::span<const geometry::CylinderSample> samples) const;
  /// A cylinder is reported if it is at least as long as its radius, is seen over 60°, scatters within noise,
  /// is straight without large holes, and if flat-sided edges and posts do not explain its points as well.
  /// Limits are lower for one that is already `known`.
  bool convincing(const geometry::CylinderShape& shape, std::span<const geometry::CylinderSample> samples,
                  bool known) const;

 private:
  const surfaces::MapView& map_;
  NormalField normals_;
  std::size_t min_points_;
  double min_radius_, min_length_, cell_;
};

}  // namespace octosurf::cylinders
