#include "surfaces/normal_field.hpp"

#include "surfaces/moments.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf {

NormalField::NormalField(PointWindow& window, const Parameters& parameters, const NoiseModel& noise)
    : window_(window),
      noise_(noise),
      resolution_(parameters.occupancy.resolution),
      smallest_(parameters.normal_radius()),
      largest_(parameters.search_radius()),
      max_curvature_(parameters.detection.max_curvature) {}

const LocalPlane& NormalField::at(PointWindow::Index i) {
  if (i >= planes_.size()) {
    planes_.resize(std::max<std::size_t>(window_.size(), i + 1));
    done_.resize(planes_.size(), false);
  }
  if (!done_[i]) {
    // Four times the noise, so that it does not drown the plane.
    const double radius = std::clamp(4 * noise_.sigma(window_[i].range_class), smallest_, largest_);
    LocalPlane plane = compute(i, radius);
    if (!plane.known && radius < largest_) plane = compute(i, largest_);
    // Computing may have loaded blocks, but i's own place stays.
    planes_[i] = plane;
    done_[i] = true;
  }
  return planes_[i];
}

LocalPlane NormalField::compute(PointWindow::Index i, double radius) {
  constexpr int fewest_neighbours = 6;
  const VoxelPoint p = window_[i];  // a copy: the window may grow
  const auto radius_sq = static_cast<float>(radius * radius);
  LocalPlane plane;
  plane.reach = std::max(1, static_cast<int>(radius / resolution_));
  int count = 0;
  float weights = 0;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f outer = Eigen::Matrix3f::Zero();
  window_.for_each_near(p.key, plane.reach, [&](PointWindow::Index j) {
    const VoxelPoint& q = window_[j];
    const Eigen::Vector3f v = q.position - p.position;
    const float distance_sq = v.squaredNorm();
    if (distance_sq > radius_sq || q.view.dot(p.view) < -0.3F) return;
    const float w = std::exp(-distance_sq / radius_sq);
    ++count;
    weights += w;
    sum += w * v;
    outer += w * v * v.transpose();
  });
  if (count < fewest_neighbours) return plane;
  Moments moments{weights, sum.cast<double>(), outer.cast<double>()};
  const PlaneFit fit = fit_plane(moments);
  // In a line: the second spread is no more than a voxel's rounding.
  if (fit.variances[1] < 0.05 * fit.variances[2] || fit.variances[1] < 0.09 * resolution_ * resolution_)
    return plane;
  plane.known = true;
  plane.normal = fit.normal.cast<float>();
  if (plane.normal.dot(p.view) < 0) plane.normal = -plane.normal;
  plane.curvature = static_cast<float>(fit.curvature());
  plane.thickness = static_cast<float>(std::sqrt(fit.variances[0]));
  const double sigma_sq = std::pow(noise_.sigma(p.range_class), 2);
  const double by_noise = sigma_sq / (sigma_sq + radius * radius / 2);
  plane.flat = plane.curvature <= std::max(max_curvature_, std::min(1.5 * by_noise, 0.15));
  return plane;
}

}  // namespace octosurf
