#pragma once

#include "geometry/lanes.hpp"
#include "surfaces/map_view.hpp"

#include <span>
#include <vector>

namespace octosurf::detection {

/// A region's points as RANSAC scores them: flat arrays of floats about the region's first point.
class RegionPoints {
 public:
  using Index = occupancy::PointWindow::Index;

  /// Of every `stride`-th of `points` (not empty). `cos_aligned`: least cosine between a plane's
  /// normal and an inlier's own; −1: no limit.
  RegionPoints(const surfaces::MapView& map, std::span<const Index> points, std::size_t stride,
               float cos_aligned);

  std::size_t size() const { return size_; }

  /// How many lie on the plane, within their own tolerances; gives up with less once it cannot be
  /// more than `to_beat`.
  std::size_t count(const Plane& plane, std::size_t to_beat) const;
  /// Calls visit(k, belongs) for k = 0 … size() − 1.
  template <class Visit>
  void for_each(const Plane& plane, Visit&& visit) const {
    const Local p = local(plane);
    for (std::size_t k = 0; k < size_; k += 4) {
      const geometry::LaneMask on = belong(k, p);
      for (std::size_t lane = 0; lane < 4 && k + lane < size_; ++lane) visit(k + lane, on[lane] != 0);
    }
  }

 private:
  struct Local {
    Eigen::Vector3f normal;
    float offset;
  };
  Local local(const Plane& plane) const {
    return {plane.normal.cast<float>(), static_cast<float>(plane.offset - plane.normal.dot(reference_))};
  }
  geometry::LaneMask belong(std::size_t k, const Local& p) const {
    const geometry::Lanes distance = p.normal.x() * geometry::load_lanes(&x_[k]) +
                                     p.normal.y() * geometry::load_lanes(&y_[k]) +
                                     p.normal.z() * geometry::load_lanes(&z_[k]) - p.offset;
    const geometry::Lanes cosine = p.normal.x() * geometry::load_lanes(&normal_x_[k]) +
                                   p.normal.y() * geometry::load_lanes(&normal_y_[k]) +
                                   p.normal.z() * geometry::load_lanes(&normal_z_[k]);
    const geometry::Lanes facing = p.normal.x() * geometry::load_lanes(&view_x_[k]) +
                                   p.normal.y() * geometry::load_lanes(&view_y_[k]) +
                                   p.normal.z() * geometry::load_lanes(&view_z_[k]);
    const geometry::Lanes excess = geometry::load_lanes(&excess_[k]);
    constexpr auto least = static_cast<float>(sensing::NoiseModel::least_facing);
    const geometry::Lanes share =
        least + (1 - least) * (geometry::where(facing < 0, -facing) + geometry::where(facing >= 0, facing));
    const geometry::Lanes tolerance = geometry::load_lanes(&base_[k]) + excess * share;
    return (distance <= tolerance) & (-distance <= tolerance) & (cosine >= cos_aligned_);
  }

  Eigen::Vector3d reference_;
  float cos_aligned_;
  std::size_t size_;
  // Filled up to a multiple of four with points that belong nowhere.
  std::vector<float> x_, y_, z_, normal_x_, normal_y_, normal_z_, view_x_, view_y_, view_z_;
  std::vector<float> base_,
      excess_;  // tolerance of a plane seen edge-on, and how much more one seen head-on has
};

}  // namespace octosurf::detection
