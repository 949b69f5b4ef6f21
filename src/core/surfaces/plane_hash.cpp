#include "surfaces/plane_hash.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace octosurf::surfaces {

PlaneHash::PlaneHash(const Eigen::Isometry3d& frame, double resolution) : resolution_(resolution) {
  rehash(frame);
}

void PlaneHash::rehash(const Eigen::Isometry3d& frame) {
  const std::vector<Inlier> all = sorted_inliers();
  frame_ = frame;
  axes_ = (frame.linear().leftCols<2>().transpose() / resolution_).cast<float>();
  inliers_.clear();
  raster_.clear();
  polygons_stale_ = true;
  for (const Inlier& inlier : all) insert(inlier);
}

geometry::PlaneCell PlaneHash::cell_of(const Eigen::Vector3f& p) const {
  const Eigen::Vector2f uv = axes_ * (p.cast<double>() - frame_.translation()).cast<float>();
  return {static_cast<std::int32_t>(std::floor(uv.x())), static_cast<std::int32_t>(std::floor(uv.y()))};
}

std::optional<geometry::PlaneCell> PlaneHash::nearest(geometry::PlaneCell cell, int reach) const {
  if (occupied(cell)) return cell;
  constexpr int farthest = 31;  // cells on either side, of which a row of 64 has room for
  std::array<std::uint64_t, 2 * farthest + 1> rows;
  const int side = std::min(reach, farthest), width = 2 * side + 1;
  raster_.rows_from({cell.u - side, cell.v - side}, width, std::span(rows).first(width));
  for (int k = 1; k <= side; ++k)
    for (int v = -k; v <= k; ++v) {
      const std::uint64_t first = std::uint64_t{1} << (side - k), last = first << 2 * k;
      const std::uint64_t around = std::abs(v) == k ? 2 * last - first : first | last;
      if (const std::uint64_t met = rows[v + side] & around; met != 0)
        return geometry::PlaneCell{cell.u + std::countr_zero(met) - side, cell.v + v};
    }
  for (int k = farthest + 1; k <= reach; ++k)
    for (int v = -k; v <= k; ++v)
      for (int u = -k; u <= k; u += std::abs(v) == k ? 1 : 2 * k)
        if (const geometry::PlaneCell at{cell.u + u, cell.v + v}; occupied(at)) return at;
  return {};
}

Eigen::Vector3d PlaneHash::place_of(const Eigen::Vector2d& uv) const {
  return frame_ * Eigen::Vector3d(uv.x() * resolution_, uv.y() * resolution_, 0);
}

Eigen::Affine2d PlaneHash::T_frame_cells(const Eigen::Isometry3d& T_frame_map) const {
  const Eigen::Isometry3d T = T_frame_map * frame_;
  Eigen::Affine2d result = Eigen::Affine2d::Identity();
  result.linear() = resolution_ * T.linear().topLeftCorner<2, 2>();
  result.translation() = T.translation().head<2>();
  return result;
}

void PlaneHash::insert(const Inlier& inlier) {
  const geometry::PlaneCell cell = cell_of(inlier.position);
  inliers_.add(cell, inlier);
  polygons_stale_ |= raster_.change(cell, true);
}

std::optional<Inlier> PlaneHash::take_out(geometry::VoxelKey key, const Eigen::Vector3f& position) {
  const geometry::PlaneCell cell = cell_of(position);
  const std::optional<InlierTiles::Removed> removed = inliers_.remove(cell, key);
  if (!removed) return {};
  polygons_stale_ |= raster_.change(cell, !removed->cell_empty);
  return removed->inlier;
}

std::vector<Inlier> PlaneHash::sorted_inliers() const {
  std::vector<Inlier> all;
  for_each_inlier([&](const Inlier& inlier) { all.push_back(inlier); });
  std::sort(all.begin(), all.end(), [](const Inlier& a, const Inlier& b) { return a.key < b.key; });
  return all;
}

}  // namespace octosurf::surfaces
