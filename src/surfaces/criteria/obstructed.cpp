#include "surfaces/criteria/obstructed.hpp"

#include <algorithm>
#include <cmath>

namespace octosurf::surfaces {

bool obstructed(const MapView& map, const Plane& plane, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                double reach, int layers) {
  const geometry::VoxelGrid& grid = map.grid;
  const double d = grid.resolution();
  const auto onto = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p - plane.signed_distance(p) * plane.normal);
  };
  const Eigen::Vector3d from = onto(a), way = onto(b) - from;
  const int steps = static_cast<int>(std::ceil(2 * way.norm() / d));
  const auto stands_in = [&](geometry::VoxelKey key) {
    const MapView::Index i = map.window.find(key);
    if (i == occupancy::PointWindow::none) return false;
    const occupancy::VoxelPoint& p = map.window[i];
    // In upper layers points seen from behind the plane are ignored: they are of an opposite face, such as
    // the other side of a crack.
    if (layers > 1 && p.view.dot(plane.normal.cast<float>()) <= 0) return false;
    return plane.signed_distance(p.position.cast<double>()) > map.noise.tolerance(p, plane);
  };
  geometry::VoxelKey last;
  bool any = false;
  for (int layer = 1; layer <= layers; ++layer) {
    const Eigen::Vector3d start = from + (reach + layer * d) * plane.normal;
    for (int k = 0; k <= steps; ++k) {
      geometry::VoxelKey key;
      if (!grid.key_of((start + way * (static_cast<double>(k) / std::max(1, steps))).cast<float>(), key))
        continue;
      if (any && key == last) continue;  // two steps a voxel
      last = key;
      any = true;
      if (stands_in(key)) return true;
    }
  }
  return false;
}

}  // namespace octosurf::surfaces
