#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

/// CGAL's two plane finders, in Eigen's types.
namespace octosurf::bench {

struct CgalSettings {
  double tolerance = 0.015;     ///< m: a point's distance to its plane ("epsilon")
  double angle_rad = 0.5236;    ///< between a point's normal and its plane's
  double gap = 0.08;            ///< m: Efficient RANSAC's cluster_epsilon; growing has none
  std::size_t min_points = 50;  ///< of a plane
  unsigned seed = 1;            ///< of Efficient RANSAC
};

struct CgalPlanes {
  std::vector<std::vector<std::size_t>> regions;  ///< indices of the points
  double normals_ms = 0, planes_ms = 0;
};

/// Normals from 24 neighbours (PCA), as both methods need them; growing over 12 neighbours as in CGAL's
/// manual. Fewer than 30 points give nothing.
CgalPlanes cgal_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings);
CgalPlanes cgal_efficient_ransac(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings);

}  // namespace octosurf::bench
