#pragma once

#include "support/slow_polygons.hpp"
#include "surfaces/alpha_shape.hpp"
#include "surfaces/surface_model.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <random>
#include <vector>

namespace octosurf::test {

struct Disc {
  Eigen::Vector2d centre;
  double radius;
  bool holds(const Eigen::Vector2d& p) const { return (p - centre).norm() <= radius; }
};

/// Union of discs less holes: outlines with bays and necks.
struct Blob {
  std::vector<Disc> discs, holes;
  bool holds(const Eigen::Vector2d& p) const {
    const auto in = [&](const Disc& d) { return d.holds(p); };
    return std::any_of(discs.begin(), discs.end(), in) && std::none_of(holes.begin(), holes.end(), in);
  }
};

/// About `size` across, with holes of radius 0.3 to 2 times `hole`.
inline Blob random_blob(std::mt19937_64& rng, double size, double hole) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto somewhere = [&] {
    return Eigen::Vector2d(0.5 * size * Eigen::Vector2d(uniform(rng), uniform(rng)));
  };
  Blob blob;
  for (int i = 0; i < 5; ++i)
    blob.discs.push_back({somewhere(), size * (0.2 + 0.1 * std::fabs(uniform(rng)))});
  for (int i = 0; i < 6; ++i)
    blob.holes.push_back({somewhere(), hole * (0.3 + 1.7 * std::fabs(uniform(rng)))});
  return blob;
}

inline Eigen::Isometry3d random_pose(std::mt19937_64& rng, double reach = 5) {
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform(-reach, reach);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
  return pose;
}

/// Readings by voxel, and the mean of each, as an octree would hold them.
class VoxelMeans {
 public:
  explicit VoxelMeans(double d) : grid_(d) {}

  void add(const Eigen::Vector3d& p) {
    VoxelKey key;
    if (!grid_.key_of(p.cast<float>(), key)) return;
    Sum& voxel = voxels_[key.packed()];
    voxel.key = key;
    voxel.sum += p;
    ++voxel.count;
  }
  /// In key order, of range class 4.
  std::vector<Inlier> inliers() const {
    std::vector<Inlier> all;
    for (const auto& [packed, voxel] : voxels_)
      all.push_back({voxel.key, 4, (voxel.sum / voxel.count).cast<float>()});
    return all;
  }

 private:
  struct Sum {
    VoxelKey key;
    int count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  };
  VoxelGrid grid_;
  std::map<std::uint64_t, Sum> voxels_;
};

/// The voxels of a blob on the plane z = 0 of `pose`, one centroid each, as an octree would hold them.
inline std::vector<Inlier> voxels_of(const Blob& blob, const Eigen::Isometry3d& pose, double d, double size,
                                     double thickness, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  VoxelMeans voxels(d);
  const auto samples = static_cast<int>(12 * 4 * size * size / (d * d));
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d uv = size * Eigen::Vector2d(uniform(rng), uniform(rng));
    if (!blob.holds(uv)) continue;
    const Eigen::Vector3d p = pose * Eigen::Vector3d(uv.x(), uv.y(), thickness * uniform(rng));
    voxels.add(p);
  }
  std::vector<Inlier> inliers = voxels.inliers();
  for (Inlier& inlier : inliers) inlier.range_class = static_cast<std::uint8_t>(1 + rng() % 9);
  std::shuffle(inliers.begin(), inliers.end(), rng);
  return inliers;
}

inline Plane plane_of(const Eigen::Isometry3d& pose) {
  return {pose.linear().col(2), pose.linear().col(2).dot(pose.translation())};
}

/// Rings as sorted lists of vertices rounded to 1e-9, whatever vertex they start with.
inline std::vector<std::vector<std::pair<double, double>>> ring_sets(const std::vector<Polygon>& polygons) {
  std::vector<std::vector<std::pair<double, double>>> sets;
  const auto add = [&](const Ring2& ring) {
    auto& set = sets.emplace_back();
    for (const Eigen::Vector2d& p : ring) set.emplace_back(std::round(p.x() * 1e9), std::round(p.y() * 1e9));
    std::sort(set.begin(), set.end());
  };
  for (const Polygon& polygon : polygons) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

/// The same bytes: polygons, rings and vertices in the same order.
inline bool identical(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Polygon& p, const Polygon& q) {
    return p.outer == q.outer && p.holes == q.holes;
  });
}

}  // namespace octosurf::test
