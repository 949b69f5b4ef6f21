#pragma once

#include "geometry/voxel_grid.hpp"
#include "support/slow_polygons.hpp"
#include "support/testing.hpp"

namespace octosurf::test {

inline constexpr double d = 0.02, h = 0.08;  // m

struct Disc {
  Eigen::Vector2d centre;
  double radius;
  bool holds(const Eigen::Vector2d& p) const { return (p - centre).norm() <= radius; }
};

/// Union of discs less holes: outlines with bays and necks.
struct Blob {
  std::vector<Disc> discs, holes;
  bool holds(const Eigen::Vector2d& p) const;
};

/// About `size` across, with holes of radius 0.3 to 2 times `hole`.
Blob random_blob(std::mt19937_64& rng, double size, double hole);

Eigen::Isometry3d random_pose(std::mt19937_64& rng, double reach = 5);

/// Readings by voxel, and the mean of each, as an octree would hold them.
class VoxelMeans {
 public:
  explicit VoxelMeans(double resolution) : grid_(resolution) {}

  void add(const Eigen::Vector3d& p);
  /// In key order, of range class 4.
  std::vector<surfaces::Inlier> inliers() const;

 private:
  struct Sum {
    geometry::VoxelKey key;
    int count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  geometry::VoxelGrid grid_;
  std::map<std::uint64_t, Sum> voxels_;
};

/// The voxels of a blob on the plane z = 0 of `pose`, one centroid each, as an octree would hold them.
std::vector<surfaces::Inlier> voxels_of(const Blob& blob, const Eigen::Isometry3d& pose, double resolution,
                                        double size, double thickness, std::mt19937_64& rng);

Plane plane_of(const Eigen::Isometry3d& pose);

/// Rings as sorted lists of vertices rounded to 1e-9, whatever vertex they start with.
std::vector<std::vector<std::pair<double, double>>> ring_sets(const std::vector<Polygon>& polygons);

/// The same bytes: polygons, rings and vertices in the same order.
bool identical(const std::vector<Polygon>& a, const std::vector<Polygon>& b);

/// Two standard deviations of it are 2 mm at 1 mm, which is what poses leave at least.
inline sensing::NoiseModel noise_of(double sensor_noise, double range_noise = 0) {
  Parameters parameters;
  parameters.surfaces.sensor_noise = sensor_noise;
  parameters.surfaces.range_noise = range_noise;
  return sensing::NoiseModel(parameters);
}

/// Number 7, of these inliers.
inline surfaces::SurfaceModel model_of(const std::vector<surfaces::Inlier>& inliers,
                                       const Eigen::Isometry3d& pose) {
  surfaces::SurfaceModel model(7, plane_of(pose), pose.translation(), d);
  for (const surfaces::Inlier& inlier : inliers) model.add(inlier);
  return model;
}

}  // namespace octosurf::test
