#pragma once

#include "geometry/voxel_grid.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace octosurf::sensing {

/// Range classes of a point: class c ≥ 1 stands for about 0.25 m · √2^(c−1), 15 for ≥ 32 m.
inline unsigned range_class_of(float range) {
  const float c = 1 + std::round(2 * std::log2(std::max(0.25F, range) / 0.25F));
  return static_cast<unsigned>(std::clamp(c, 1.0F, 15.0F));
}
inline float range_of_class(unsigned c) { return 0.25F * std::exp2(0.5F * (static_cast<float>(c) - 1)); }

/// Octahedral coding of a unit vector with 6 bits a coordinate (Meyer et al. 2010); error ≤ 3.9°.
inline unsigned encode_view(const Eigen::Vector3f& v) {
  const float sum = v.cwiseAbs().sum();
  if (!(sum > 0 && sum <= std::numeric_limits<float>::max())) return encode_view(Eigen::Vector3f::UnitZ());
  float x = v.x() / sum, y = v.y() / sum;
  if (v.z() < 0) {
    const float folded_x = (1 - std::fabs(y)) * (x < 0 ? -1.0F : 1.0F);
    y = (1 - std::fabs(x)) * (y < 0 ? -1.0F : 1.0F);
    x = folded_x;
  }
  const auto quantised = [](float c) { return static_cast<unsigned>(std::lround((c + 1) * 31.5F)); };
  return quantised(x) | quantised(y) << 6;
}
inline Eigen::Vector3f decode_view(unsigned code) {
  const float x = static_cast<float>(code & 63) / 31.5F - 1;
  const float y = static_cast<float>(code >> 6 & 63) / 31.5F - 1;
  Eigen::Vector3f v(x, y, 1 - std::fabs(x) - std::fabs(y));
  if (v.z() < 0) {
    v.x() = (1 - std::fabs(y)) * (x < 0 ? -1.0F : 1.0F);
    v.y() = (1 - std::fabs(x)) * (y < 0 ? -1.0F : 1.0F);
  }
  return v.normalized();
}

/// decode_view() of all codes: decoding one takes a square root and divisions.
inline const std::array<Eigen::Vector3f, 4096> views = [] {
  std::array<Eigen::Vector3f, 4096> all;
  for (unsigned code = 0; code < all.size(); ++code) all[code] = decode_view(code);
  return all;
}();

/// Position of a point in its voxel, in 256ths of the edge, rounded down; and the centre of that step.
using PlaceInVoxel = std::array<std::uint8_t, 3>;
inline PlaceInVoxel place_in_voxel(const geometry::VoxelGrid& grid, geometry::VoxelKey key,
                                   const Eigen::Vector3f& point) {
  const Eigen::Vector3d relative = (point.cast<double>() - grid.corner_of(key)) * (256.0 / grid.resolution());
  const auto quantised = [](double c) { return static_cast<std::uint8_t>(std::clamp(c, 0.0, 255.0)); };
  return {quantised(relative.x()), quantised(relative.y()), quantised(relative.z())};
}
inline Eigen::Vector3d point_at(const geometry::VoxelGrid& grid, geometry::VoxelKey key,
                                const PlaceInVoxel& place) {
  const Eigen::Vector3d offset(place[0] + 0.5, place[1] + 0.5, place[2] + 0.5);
  return grid.corner_of(key) + offset * (grid.resolution() / 256);
}

}  // namespace octosurf::sensing
