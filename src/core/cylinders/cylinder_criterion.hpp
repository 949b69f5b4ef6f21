#pragma once

#include "geometry/cylinder_fit.hpp"
#include "sensing/reading_model.hpp"
#include "surfaces/map_view.hpp"

#include <cmath>
#include <optional>
#include <span>
#include <vector>

namespace octosurf::cylinders {

constexpr double largest_radius = 0.5;  // m: wider ones are found as planes

/// Which points belong to a cylinder, and which shapes are reported as one; by the reading model, as for
/// planes.
class CylinderCriterion {
 public:
  explicit CylinderCriterion(const surfaces::MapView& map);

  std::size_t min_points() const { return min_points_; }  ///< inliers: n

  /// Whether the reading model says that it is of the lateral surface, seen from outside.
  bool belongs(const geometry::CylinderShape& shape, const occupancy::VoxelPoint& p) const {
    const Eigen::Vector3d outward = shape.from_axis(p.position.cast<double>());
    const double rho = outward.norm();
    return model_.gain(rho - shape.radius, p.range_class, outward.dot(p.view.cast<double>()) / rho) > 0;
  }
  /// m, off the lateral surface, at which a point that belonged no longer does: with half of its reach to
  /// spare, so that it does not come and go with every fit.
  double reach(unsigned range_class) const { return 1.5 * model_.reach(range_class, 1); }

  geometry::CylinderSample sample(const Eigen::Vector3f& position, unsigned range_class) const {
    return {position.cast<double>(), std::sqrt(model_.variance(range_class, 1))};
  }
  /// Of at most so many of the points.
  std::vector<geometry::CylinderSample> samples(std::span<const PointId> points, std::size_t most) const;
  /// Of a cylinder's inliers, up to 2,000.
  std::vector<geometry::CylinderSample> samples(const surfaces::CylinderModel& cylinder) const;

  /// A first shape from the quadratic surface through the points of a bent patch (not empty), if its radius
  /// may be a cylinder's.
  std::optional<geometry::CylinderShape> through(std::span<const PointId> bent) const;

  /// Whether the points scatter about the shape as noise does, rather than evenly.
  static bool explains(const geometry::CylinderShape& shape,
                       std::span<const geometry::CylinderSample> samples);
  /// Whether it is reported: long and round enough, straight, explained by noise, and better so than by the
  /// flat sides of edges and posts. `known`: it was found before, and need not pay for the search.
  bool convincing(const geometry::CylinderShape& shape, std::span<const geometry::CylinderSample> samples,
                  bool known) const;

 private:
  const surfaces::MapView& map_;
  sensing::ReadingModel model_;
  std::size_t min_points_;
};

}  // namespace octosurf::cylinders
