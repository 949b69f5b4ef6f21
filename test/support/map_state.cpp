#include "support/map_state.hpp"

namespace octosurf::test {

occupancy::OccupancyDelta occupy(surfaces::MapState& state, const Scan& scan) {
  sensing::Downsampler downsample(state.occupancy.grid());
  const sensing::VoxelScan voxels = downsample(scan, 0, std::numeric_limits<double>::infinity());
  occupancy::OccupancyDelta delta = state.occupancy.insert(
      voxels, downsample, state.parameters.occupancy.preserve_surfaces ? &state.surfaces : nullptr);
  state.points += delta.appeared.size();
  state.points -= delta.vanished.size();
  return delta;
}

Scan rectangle_scan(const Eigen::Vector3d& eye, const Eigen::Vector3d& corner, const Eigen::Vector3d& edge_u,
                    const Eigen::Vector3d& edge_v, double spacing) {
  Scan scan;
  scan.T_map_sensor.translation() = eye;
  const auto steps = [&](const Eigen::Vector3d& e) { return static_cast<int>(e.norm() / spacing); };
  for (int v = 0; v <= steps(edge_v); ++v)
    for (int u = 0; u <= steps(edge_u); ++u)
      scan.points.push_back(
          (corner + u * spacing * edge_u.normalized() + v * spacing * edge_v.normalized() - eye)
              .cast<float>());
  return scan;
}

Scan plate_scan(const Eigen::Vector3d& eye, int from_column, int to_column, int rows) {
  constexpr double d = 0.02;
  const auto length = [](int voxels) {
    return (voxels - 0.5) * d;
  };  // up to the last one's middle, and not beyond
  return rectangle_scan(eye, {(from_column + 0.5) * d, d / 2, d / 2}, {length(to_column - from_column), 0, 0},
                        {0, length(rows), 0}, d);
}

}  // namespace octosurf::test
