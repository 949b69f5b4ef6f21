#include "detection/region_points.hpp"

#include <algorithm>

namespace octosurf::detection {

RegionPoints::RegionPoints(const surfaces::MapView& map, std::span<const Index> points, std::size_t stride,
                           float cos_aligned)
    : reference_(map.window[points.front()].position.cast<double>()),
      // Rounded to a float a cosine may be below −1; without a limit every point must pass.
      cos_aligned_(cos_aligned <= -1 ? -2 : cos_aligned),
      size_((points.size() + stride - 1) / stride) {
  const std::size_t lanes = (size_ + 3) / 4 * 4;
  for (std::vector<float>* column :
       {&x_, &y_, &z_, &normal_x_, &normal_y_, &normal_z_, &view_x_, &view_y_, &view_z_, &excess_})
    column->resize(lanes);
  base_.resize(lanes, -1);
  const double base = map.noise.base_tolerance();
  for (std::size_t k = 0; k < size_; ++k) {
    const Index i = points[k * stride];
    const occupancy::VoxelPoint& p = map.window[i];
    const Eigen::Vector3f at = (p.position.cast<double>() - reference_).cast<float>();
    x_[k] = at.x();
    y_[k] = at.y();
    z_[k] = at.z();
    base_[k] = static_cast<float>(base);
    excess_[k] = static_cast<float>(map.noise.tolerance(p.range_class) - base);
    view_x_[k] = p.view.x();
    view_y_[k] = p.view.y();
    view_z_[k] = p.view.z();
    const Eigen::Vector3f& normal = map.normals.at(i).normal;
    normal_x_[k] = normal.x();
    normal_y_[k] = normal.y();
    normal_z_[k] = normal.z();
  }
}

std::size_t RegionPoints::count(const Plane& plane, std::size_t to_beat) const {
  constexpr std::size_t step = 256;
  const Local p = local(plane);
  std::size_t found = 0;
  for (std::size_t start = 0; start < x_.size(); start += step) {
    if (found + (size_ - start) <= to_beat) break;
    geometry::LaneMask counts{};
    const std::size_t end = std::min(x_.size(), start + step);
    for (std::size_t k = start; k < end; k += 4) counts -= belong(k, p);
    found += static_cast<std::size_t>(counts[0] + counts[1] + counts[2] + counts[3]);
  }
  return found;
}

}  // namespace octosurf::detection
