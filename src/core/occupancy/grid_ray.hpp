#pragma once

#include "sensing/downsample.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace octosurf::occupancy {

/// One ray of a scan, from the sensor to where it ends.
struct GridRay {
  std::array<float, 3> end;          ///< map frame, m
  std::array<std::uint16_t, 3> key;  ///< voxel of `end`, as OctoMap's OcTreeKey
  bool hit = true;                   ///< that voxel is hit; else the ray was cut there
  bool to_centre = true;             ///< `end` is the centre of that voxel
};

/// Where the rays start, and the voxel edge.
struct GridOrigin {
  std::array<float, 3> position{};  ///< map frame, m
  std::array<std::uint16_t, 3> key{};
  double resolution = 0;
};

/// State of a walk from voxel to voxel (Amanatides & Woo, 1987) in the arithmetic of OctoMap's
/// `computeRayKeys`, so that both pass the same voxels to the last bit.
struct GridWalk {
  std::array<double, 3> t{};   ///< where the ray leaves the current voxel, per axis, m from the origin
  std::array<double, 3> dt{};  ///< from one border to the next
  std::array<int, 3> sign{};
  std::int64_t steps = 0;  ///< |Δx|+|Δy|+|Δz| to the end voxel: the steps of a ray to a voxel's centre
  double length = 0;

  GridWalk() = default;
  GridWalk(const GridRay& ray, const GridOrigin& from) {
    std::array<float, 3> direction;
    for (std::size_t a = 0; a < 3; ++a) direction[a] = ray.end[a] - from.position[a];
    const auto norm = static_cast<float>(sensing::norm_of(direction[0], direction[1], direction[2]));
    length = static_cast<double>(norm);
    for (std::size_t a = 0; a < 3; ++a) {
      direction[a] /= norm;
      const double d = static_cast<double>(direction[a]);
      sign[a] = d > 0 ? 1 : d < 0 ? -1 : 0;
      if (sign[a] == 0) {
        t[a] = dt[a] = std::numeric_limits<double>::max();
      } else {
        const int key = from.key[a] - geometry::VoxelGrid::origin;
        double border = (static_cast<double>(key) + 0.5) * from.resolution;
        border += static_cast<double>(static_cast<float>(sign[a] * from.resolution * 0.5));
        t[a] = (border - static_cast<double>(from.position[a])) / d;
        dt[a] = from.resolution / std::fabs(d);
      }
      steps += std::abs(int{ray.key[a]} - int{from.key[a]});
    }
  }

  /// Axis of the next border. The order of comparisons is OctoMap's, because it decides ties.
  std::size_t next_axis() const { return t[0] < t[1] ? (t[0] < t[2] ? 0 : 2) : (t[1] < t[2] ? 1 : 2); }

  /// A ray that does not end in a voxel centre stops at its length or in its end voxel, whichever OctoMap
  /// reaches first. True if it certainly takes `steps` steps: it enters the end voxel well before its length,
  /// and no axis crosses an extra border before that.
  bool ends_clearly(const GridRay& ray, const GridOrigin& from) const {
    const double margin = 1e-9 * length;
    double entered = 0, left = std::numeric_limits<double>::max();
    for (std::size_t a = 0; a < 3; ++a) {
      if (sign[a] == 0) continue;
      const int crossed = (int{ray.key[a]} - int{from.key[a]}) * sign[a];
      if (crossed < 0) return false;
      if (crossed > 0) entered = std::fmax(entered, t[a] + (crossed - 1) * dt[a]);
      left = std::fmin(left, t[a] + crossed * dt[a]);
    }
    return entered + margin < length && entered + margin < left;
  }
};

}  // namespace octosurf::occupancy
