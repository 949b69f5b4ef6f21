#pragma once

#include "bench/labelled_methods.hpp"

namespace octosurf::bench {

/// How well one surface is the support (a table) of a labelled cloud seen from the origin.
struct SupportScore {
  SurfaceId surface = 0;  ///< the one that holds most of the support's points
  /// Intersection over union of two sets of labelled points: label 1, and those whose voxel is the
  /// surface's.
  double iou_points = 0;
  /// The same as one sees it, pixel by pixel: label 1, and the pixels whose ray meets the surface's
  /// polygons. What lies on the table hides what is behind it, so polygons that run on under or behind a
  /// thing count against the surface.
  double iou_pixels = 0;
  double iou_pixels_grown = 0;  ///< the same with polygons grown by d/2: they end at voxels' centroids
  double offset_m = 0;          ///< signed: label's centroid to the surface's plane
  double angle_rad = 0;         ///< between the surface's plane and the least-squares plane of the label
  /// The same against the least-squares plane of the centroids of the voxels that hold label 1 alone:
  /// voxels weigh every part of the table alike, pixels its near part more, and a camera's distortion bends
  /// the table.
  double even_offset_m = 0, even_angle_rad = 0;
  double rms_m = 0;        ///< of the label's points to their least-squares plane
  std::size_t layers = 0;  ///< surfaces with at least 2 % of the support's points
  std::size_t holes = 0;   ///< rings inside its polygons
};

SupportScore score_support(const VoxelCloud& cloud, const Segmentation& segmentation);

}  // namespace octosurf::bench
