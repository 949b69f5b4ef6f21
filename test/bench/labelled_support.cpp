#include "bench/labelled_support.hpp"

#include "bench/support.hpp"
#include "evaluation/planar_region.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

constexpr std::uint32_t support = 1;
constexpr double worth_a_layer = 0.02;

/// Intersection over union of the support's points and those that `in` is true of, over labelled points.
template <class In>
double iou(const VoxelCloud& cloud, const In& in) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const std::uint32_t label = cloud.cloud->labels[i];
    if (label == 0) continue;
    const bool found = in(i);
    both += found && label == support;
    either += found || label == support;
  }
  return either == 0 ? 0 : static_cast<double>(both) / static_cast<double>(either);
}

std::size_t count_layers(const VoxelCloud& cloud, const std::vector<SurfaceId>& found) {
  std::map<SurfaceId, std::size_t> points;
  std::size_t all = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (cloud.cloud->labels[i] != support) continue;
    ++all;
    if (found[i] != 0) ++points[found[i]];
  }
  std::size_t layers = 0;
  for (const auto& [id, count] : points)
    layers += static_cast<double>(count) >= worth_a_layer * static_cast<double>(all);
  return layers;
}

/// Least-squares plane of the voxels in which every labelled point is the support's.
FittedPlane plane_of_voxels(const VoxelCloud& cloud) {
  std::vector<bool> held(cloud.centroids.size(), false), other(cloud.centroids.size(), false);
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    (cloud.cloud->labels[i] == support ? held : other)[cloud.voxel_of[i]] = true;
  std::vector<std::size_t> voxels;
  for (std::size_t k = 0; k < held.size(); ++k)
    if (held[k] && !other[k]) voxels.push_back(k);
  return least_squares_plane(cloud.centroids, voxels);
}

const evaluation::LabelScore& label_score(const evaluation::LabelEvaluation& evaluation) {
  for (const evaluation::LabelScore& score : evaluation.label_scores)
    if (score.label == support) return score;
  throw Error(Error::Kind::data, "labels", "no point belongs to the support", "label 1 is expected");
}

}  // namespace

SupportScore score_support(const VoxelCloud& cloud, const Segmentation& segmentation) {
  const evaluation::LabelScore& label = label_score(segmentation.evaluation);
  SupportScore score;
  score.surface = label.surface;
  score.rms_m = label.rms_m;
  score.layers = count_layers(cloud, segmentation.found);
  const Surface* surface = segmentation.snapshot.find(label.surface);
  if (surface == nullptr) return score;
  score.offset_m = label.offset_m;
  score.angle_rad = label.normal_rad;
  const FittedPlane even = plane_of_voxels(cloud);
  score.even_offset_m = surface->plane.signed_distance(even.centroid);
  score.even_angle_rad = std::atan2(even.plane.normal.cross(surface->plane.normal).norm(),
                                    std::abs(even.plane.normal.dot(surface->plane.normal)));
  for (const Polygon& polygon : surface->polygons) score.holes += polygon.holes.size();

  score.iou_points = iou(cloud, [&](std::size_t i) { return segmentation.found[i] == label.surface; });
  const evaluation::PlanarRegion region(surface->polygons);
  const Eigen::Isometry3d to_surface = surface->T_map_surface.inverse();
  const auto ray_meets = [&](std::size_t i, double margin) {
    const double stretch = surface->plane.offset / surface->plane.normal.dot(cloud.points[i]);
    if (!(std::isfinite(stretch) && stretch > 0)) return false;
    return region.within((to_surface * (stretch * cloud.points[i])).head<2>(), margin);
  };
  score.iou_pixels = iou(cloud, [&](std::size_t i) { return ray_meets(i, 0); });
  score.iou_pixels_grown = iou(cloud, [&](std::size_t i) { return ray_meets(i, cloud.resolution / 2); });
  return score;
}

}  // namespace octosurf::bench
