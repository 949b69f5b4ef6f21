#pragma once

#include "evaluation/planar_region.hpp"
#include "evaluation/truth.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <numbers>
#include <random>
#include <unordered_set>
#include <utility>
#include <vector>

namespace octosurf::bench {

inline constexpr double max_slope = std::numbers::pi / 6;  ///< rad, of what a foot is put on
/// m off every true outline: no rim any more, nothing is there.
inline constexpr double false_from = 0.05;

/// What is true of the places where a foot may be.
class Ground {
 public:
  /// `tolerance`: m off a face's plane at which a surface's point still is on it.
  Ground(const evaluation::Truth& truth, double tolerance);

  /// How far off every face's outline a point of a surface lies; false_from if that far or farther.
  double off(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const;

  /// A contact on a face that slopes little, anywhere that the sensor saw and at any heading.
  struct Place {
    const evaluation::TrueFace* face = nullptr;
    Eigen::Isometry3d T_map_contact;
    bool supported = false, seen = false;  ///< all of `points`
  };
  Place place(std::mt19937_64& rng, const std::vector<Eigen::Vector2d>& points) const;

  bool has_ground() const;

 private:
  struct Face {
    const evaluation::TrueFace* truth;
    evaluation::PlanarRegion region;
    Eigen::Isometry3d T_face_map;
    std::vector<std::pair<int, int>> cells;
    std::unordered_set<std::int64_t> seen;
  };
  static std::int64_t key(int column, int row) {
    return std::int64_t{column} * (std::int64_t{1} << 32) + row;
  }

  double tolerance_, cell_;
  std::vector<Face> faces_;
};

}  // namespace octosurf::bench
