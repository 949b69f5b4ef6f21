#pragma once

#include "sensing/downsample.hpp"

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <tsl/robin_set.h>
#include <vector>

#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>
#include <octosurf/surface.hpp>

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
using CgalMethod = CgalPlanes (*)(const std::vector<Eigen::Vector3f>&, const CgalSettings&);

/// CGAL's input, one centroid per voxel of all scans, as octosurf starts from; and its regions as surfaces.
class CgalInput {
 public:
  explicit CgalInput(const Parameters& parameters)
      : parameters_(parameters), downsampler_(geometry::VoxelGrid(parameters.occupancy.resolution)) {}

  void add(const Scan& scan);
  /// s, h, n and the angle are octosurf's defaults.
  CgalPlanes planes(CgalMethod method) const;
  Snapshot snapshot(const CgalPlanes& planes) const;

 private:
  SurfacePtr surface_of(const std::vector<std::size_t>& region, SurfaceId id) const;

  Parameters parameters_;
  sensing::Downsampler downsampler_;
  std::vector<Eigen::Vector3f> points_, views_;
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen_;
};

}  // namespace octosurf::bench
