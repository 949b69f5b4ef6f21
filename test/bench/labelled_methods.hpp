#pragma once

#include "evaluation/labels.hpp"

#include <Eigen/Core>
#include <string>
#include <vector>

#include <octosurf/mapper.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/surface.hpp>

/// Ways to get planes from one labelled cloud, all told alike.
namespace octosurf::bench {

/// A labelled cloud as every method gets it: grouped by voxels of edge d, and the centroid of each.
struct VoxelCloud {
  const evaluation::LabelledCloud* cloud = nullptr;
  evaluation::LabelOptions judging;        ///< how segmentations of it are scored
  double resolution = 0;                   ///< d, m
  std::vector<Eigen::Vector3d> points;     ///< the cloud's
  std::vector<Eigen::Vector3f> centroids;  ///< one per voxel
  std::vector<std::size_t> voxel_of;       ///< per point, index into centroids
};
VoxelCloud group_by_voxel(const evaluation::LabelledCloud& cloud, double resolution,
                          const evaluation::LabelOptions& judging = {});

/// Median distance of neighbouring readings: of the points that follow one another in the file (row by
/// row), those less than 5 % of their range apart.
double natural_spacing(const evaluation::LabelledCloud& cloud);

/// What one method made of a cloud.
struct Segmentation {
  std::string method, settings;  ///< settings: what was tried for it, e.g. "15°, 5 mm"
  Snapshot snapshot;             ///< planes at least
  std::vector<SurfaceId> found;  ///< per point, the surface of its voxel; 0: none
  double ms = 0;
  evaluation::LabelEvaluation evaluation;
};

/// Default parameters at the cloud's resolution, all ranges mapped.
Parameters parameters_for(const VoxelCloud& cloud);

/// One scan from the origin into an empty Mapper; a point belongs to the surface of its voxel (Map::at).
Segmentation segment_ours(const VoxelCloud& cloud, const Parameters& parameters);

/// CGAL's two on the voxels' centroids; a point belongs to its voxel's region. Several settings of its
/// manual and examples each; the one with the most correct labels (then the least noise) is returned:
/// - growing: 15° and 25°;
/// - Efficient RANSAC: normal threshold 0.87 and 0.95, cluster gap 2.5 d and h;
/// - both: tolerance 5 mm, 10 mm and octosurf's s; least size octosurf's n.
Segmentation segment_region_growing(const VoxelCloud& cloud);
Segmentation segment_ransac(const VoxelCloud& cloud);

/// The paper's pipeline from stock PCL parts. It keeps no points, so a point belongs to the surface whose
/// plane is nearest of those within s whose polygon contains it (by_polygons).
Segmentation segment_paper(const VoxelCloud& cloud, const Parameters& parameters, const std::string& name);

/// The same surfaces, but a point belongs to the one that by_polygons finds.
Segmentation told_by_polygons(const VoxelCloud& cloud, const Segmentation& segmentation, double tolerance);

/// The surface of each point: nearest plane of those at most `tolerance` away whose polygon contains
/// the point's foot or has a ring within `margin` of it.
std::vector<SurfaceId> by_polygons(const Snapshot& snapshot, const std::vector<Eigen::Vector3d>& points,
                                   double tolerance, double margin);

}  // namespace octosurf::bench
