#pragma once

#include "sensing/reading_model.hpp"

#include <Eigen/Core>
#include <cmath>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// The occupied part of a voxel. For a voxel of a surface that is the surface's plane: detection assigned its
/// reading to that plane, and its distance is noise, which reaches several voxels off a wall seen from afar.
/// So its cube is moved along the normal onto the plane and flattened to the plane's uncertainty. For others
/// the position within the cube is unknown.
struct VoxelMatter {
  Eigen::Vector3d middle;                            ///< map frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the plane; zero: all of the cube
  double half_edge = 0;                              ///< of the cube, m
  double half_depth = 0;                             ///< to either side of the plane, m

  /// Its extent along a direction of the map frame, of any length, times that length.
  double reach(const Eigen::Vector3d& along) const {
    const double off_plane = along.dot(normal);
    return half_edge * (along - off_plane * normal).lpNorm<1>() + half_depth * std::abs(off_plane);
  }
  bool flat() const { return half_depth > 0; }
};

/// Computes it for consecutive voxels, which mostly are of the same surface.
class MatterOfVoxels {
 public:
  /// m. Maximum displacement of a voxel: the largest distance of a reading from its plane. A voxel farther
  /// off (tolerances are unbounded) keeps its cube.
  static constexpr double farthest_move = sensing::ReadingModel::clutter_depth / 2;
  /// In voxel edges: maximum extent from the middle. Cubes: half a diagonal, √3/2; flat voxels: that along
  /// the plane and less off it, together √2 times as far.
  static constexpr double farthest_reach = 1.2248;
  /// Standard deviations of a plane's height: 3 include 99.7 %.
  static constexpr double deviations = 3;

  /// The planes to use; none (nullptr): every voxel counts as its cube.
  MatterOfVoxels(const Snapshot* surfaces, double resolution)
      : surfaces_(surfaces), half_edge_(resolution / 2) {}

  VoxelMatter operator()(const OccupancyView::Voxel& voxel) {
    const VoxelMatter cube{voxel.center, Eigen::Vector3d::Zero(), half_edge_, 0};
    const Surface* surface = of(voxel.surface);
    if (surface == nullptr) return cube;
    const Plane& plane = surface->plane;
    const double off = plane.signed_distance(voxel.center);
    if (std::abs(off) > farthest_move) return cube;
    const VoxelMatter flat{voxel.center - off * plane.normal, plane.normal, half_edge_,
                           half_depth(*surface, voxel.center)};
    // A plane less certain than the voxel gives no better bound.
    return flat.half_depth < cube.reach(plane.normal) ? flat : cube;
  }

 private:
  const Surface* of(SurfaceId id) {
    if (surfaces_ == nullptr || id == 0) return nullptr;
    if (id != last_id_) {
      last_id_ = id;
      last_ = surfaces_->find(id);
    }
    return last_;
  }
  /// Adds the readings' common error, which the covariance does not include.
  static double half_depth(const Surface& surface, const Eigen::Vector3d& at) {
    const Eigen::Vector3d from_origin = at - surface.T_map_surface.translation();
    const Eigen::Vector3d uv1(surface.T_map_surface.linear().col(0).dot(from_origin),
                              surface.T_map_surface.linear().col(1).dot(from_origin), 1);
    return deviations * std::sqrt(uv1.dot(surface.covariance * uv1) +
                                  sensing::ReadingModel::pose_sigma * sensing::ReadingModel::pose_sigma);
  }

  const Snapshot* surfaces_;
  double half_edge_;
  SurfaceId last_id_ = 0;
  const Surface* last_ = nullptr;
};

}  // namespace octosurf::planning
