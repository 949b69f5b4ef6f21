#pragma once

#include "sensing/reading_model.hpp"

#include <Eigen/Core>
#include <cmath>

#include <octosurf/occupancy.hpp>
#include <octosurf/surface.hpp>

namespace octosurf::planning {

/// Where there is something in an occupied voxel. That of a surface is the surface's plane: detection took
/// its reading for one of that plane, and what it lies off by for noise, which reaches several voxels off a
/// wall that was seen from afar. So its cube, moved along the normal onto the plane and flattened to what is
/// not known of the plane. Of all others nothing better is known than that it is somewhere in the cube.
struct VoxelMatter {
  Eigen::Vector3d middle;                            ///< map frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of the plane; zero: all of the cube
  double half_edge = 0;                              ///< of the cube, m
  double half_depth = 0;                             ///< to either side of the plane, m

  /// How far it reaches along a direction of the map frame, of any length, times that length.
  double reach(const Eigen::Vector3d& along) const {
    const double off_plane = along.dot(normal);
    return half_edge * (along - off_plane * normal).lpNorm<1>() + half_depth * std::abs(off_plane);
  }
  bool flat() const { return half_depth > 0; }
};

/// Tells it of one voxel after the other, which mostly are of the same surface.
class MatterOfVoxels {
 public:
  /// m. How far a voxel may be moved: no reading farther off a plane is asked whether it is the plane's. One
  /// that is all the same (tolerances grow without bound) keeps its cube.
  static constexpr double farthest_move = sensing::ReadingModel::clutter_depth / 2;
  /// Of the voxel's edge. No matter reaches farther from its middle: a cube's corners half a diagonal, √3/2;
  /// what is flat so far along its plane and less than that off it, which together is √2 times as far.
  static constexpr double farthest_reach = 1.2248;
  /// Of the deviation of a plane's height: 3, within which 99.7 % of all are.
  static constexpr double deviations = 3;

  /// Whose planes; none (nullptr): every voxel stands for its cube.
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
    // A plane that is known no better than the voxel says no more than that.
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
  /// What readings have in common counts beside what they scatter, of which alone the covariance knows.
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
