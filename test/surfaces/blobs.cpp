#include "surfaces/blobs.hpp"

namespace octosurf::test {

bool Blob::holds(const Eigen::Vector2d& p) const {
  const auto in = [&](const Disc& disc) { return disc.holds(p); };
  return std::any_of(discs.begin(), discs.end(), in) && std::none_of(holes.begin(), holes.end(), in);
}

void VoxelMeans::add(const Eigen::Vector3d& p) {
  geometry::VoxelKey key;
  if (!grid_.key_of(p.cast<float>(), key)) return;
  Sum& voxel = voxels_[key.packed()];
  voxel.key = key;
  voxel.sum += p;
  ++voxel.count;
}

std::vector<surfaces::Inlier> VoxelMeans::inliers() const {
  std::vector<surfaces::Inlier> all;
  for (const auto& [packed, voxel] : voxels_)
    all.push_back({voxel.key, 4, (voxel.sum / voxel.count).cast<float>()});
  return all;
}

Blob random_blob(std::mt19937_64& rng, double size, double hole) {
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

Eigen::Isometry3d random_pose(std::mt19937_64& rng, double reach) {
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform(-reach, reach);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::Quaterniond(gauss(rng), gauss(rng), gauss(rng), gauss(rng)).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
  return pose;
}

std::vector<surfaces::Inlier> voxels_of(const Blob& blob, const Eigen::Isometry3d& pose, double resolution,
                                        double size, double thickness, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  VoxelMeans voxels(resolution);
  const auto samples = static_cast<int>(12 * 4 * size * size / (resolution * resolution));
  for (int i = 0; i < samples; ++i) {
    const Eigen::Vector2d uv = size * Eigen::Vector2d(uniform(rng), uniform(rng));
    if (!blob.holds(uv)) continue;
    const Eigen::Vector3d p = pose * Eigen::Vector3d(uv.x(), uv.y(), thickness * uniform(rng));
    voxels.add(p);
  }
  std::vector<surfaces::Inlier> inliers = voxels.inliers();
  for (surfaces::Inlier& inlier : inliers) inlier.range_class = static_cast<std::uint8_t>(1 + rng() % 9);
  std::shuffle(inliers.begin(), inliers.end(), rng);
  return inliers;
}

Plane plane_of(const Eigen::Isometry3d& pose) {
  return {pose.linear().col(2), pose.linear().col(2).dot(pose.translation())};
}

std::vector<std::vector<std::pair<double, double>>> ring_sets(const std::vector<Polygon>& polygons) {
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

bool identical(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Polygon& p, const Polygon& q) {
    return p.outer == q.outer && p.holes == q.holes;
  });
}

}  // namespace octosurf::test
