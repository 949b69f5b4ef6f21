#pragma once

#include "cylinders/cylinder_rules.hpp"

#include <optional>
#include <span>
#include <vector>

namespace octosurf::cylinders {

/// Extracts cylinders from a region of pending points (the paper's own extension, III-C4).
///
/// RANSAC over two oriented points, whose normals give the axis' direction and the radius; the best is
/// refined to its inliers by least squares; of the segments along the axis that are more than h apart the one
/// with most points is taken. Random numbers depend on the region only.
class CylinderExtraction {
 public:
  struct ExtractedCylinder {
    geometry::CylinderShape shape;
    std::vector<PointId> inliers;  ///< in the region's order
  };

  CylinderExtraction(const surfaces::MapView& map, CylinderRules& rules) : map_(map), rules_(rules) {}

  /// The convincing cylinder with most points, if any. `region` is not empty and in key order.
  std::optional<ExtractedCylinder> operator()(std::span<const PointId> region);

 private:
  struct Oriented {
    Eigen::Vector3f position;  // relative to the region's first point
    Eigen::Vector3f normal;
    float tolerance;
  };
  struct Guess {
    Eigen::Vector3f point, axis;
    float radius;
  };
  std::vector<Oriented> oriented(std::span<const PointId> region);
  std::optional<Guess> guess(const Oriented& a, const Oriented& b) const;
  static std::size_t count(const Guess& guess, std::span<const Oriented> points, std::size_t to_beat);
  std::optional<geometry::CylinderShape> best_shape(std::span<const PointId> region);
  std::vector<PointId> inliers_of(const geometry::CylinderShape& shape, std::span<const PointId> region);
  std::vector<PointId> fullest_stretch(const geometry::CylinderShape& shape, std::vector<PointId> inliers);

  const surfaces::MapView& map_;
  CylinderRules& rules_;
};

}  // namespace octosurf::cylinders
