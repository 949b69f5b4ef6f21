#include "bench/labelled_methods.hpp"

#include "bench/cgal_planes.hpp"
#include "bench/support.hpp"
#include "evaluation/planar_region.hpp"
#include "reference/paper_pipeline.hpp"
#include "sensing/downsample.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;
constexpr double out_of_sight = 100;  // m: labelled clouds are rooms

Scan scan_of(const evaluation::LabelledCloud& cloud) {
  Scan scan;
  scan.points = cloud.points;
  scan.name = cloud.name;
  return scan;
}

/// Regions of centroids as surfaces 1, 2, …
Segmentation from_regions(const VoxelCloud& cloud, const CgalPlanes& planes) {
  Segmentation result;
  result.ms = planes.normals_ms + planes.planes_ms;
  result.snapshot.resolution = cloud.resolution;
  std::vector<SurfaceId> of_voxel(cloud.centroids.size(), 0);
  for (const auto& region : planes.regions) {
    auto surface = std::make_shared<Surface>();
    surface->id = static_cast<SurfaceId>(result.snapshot.surfaces.size() + 1);
    surface->plane = least_squares_plane(cloud.centroids, region).plane;
    surface->inliers = region.size();
    for (const std::size_t i : region) of_voxel[i] = surface->id;
    result.snapshot.surfaces.push_back(std::move(surface));
  }
  for (const std::size_t voxel : cloud.voxel_of) result.found.push_back(of_voxel[voxel]);
  return result;
}

void judge(const VoxelCloud& cloud, Segmentation& result) {
  result.evaluation =
      evaluation::evaluate_labels(*cloud.cloud, cloud.points, result.found, result.snapshot, cloud.judging);
}

using FindPlanes = CgalPlanes (*)(const std::vector<Eigen::Vector3f>&, const CgalSettings&);

/// The best of several settings, chosen in the method's favour.
class BestOf {
 public:
  BestOf(const VoxelCloud& cloud, std::string method, FindPlanes find_planes)
      : cloud_(cloud), method_(std::move(method)), find_planes_(find_planes) {}

  void try_settings(const CgalSettings& settings) {
    Segmentation result = from_regions(cloud_, find_planes_(cloud_.centroids, settings));
    result.method = method_;
    result.settings = fixed(settings.angle_rad * deg, 0) + "°, " + fixed(settings.tolerance * 1e3, 0) +
                      " mm, gap " + fixed(settings.gap * 1e3, 0) + " mm";
    judge(cloud_, result);
    const auto rank = [](const Segmentation& s) {
      return std::pair(s.evaluation.correct, -static_cast<double>(s.evaluation.noise));
    };
    if (best_.found.empty() || rank(result) > rank(best_)) best_ = std::move(result);
  }
  Segmentation take() { return std::move(best_); }

 private:
  const VoxelCloud& cloud_;
  std::string method_;
  FindPlanes find_planes_;
  Segmentation best_;
};

CgalSettings common_settings(const VoxelCloud& cloud) {
  CgalSettings settings;
  settings.min_points = static_cast<std::size_t>(parameters_for(cloud).min_surface_points());
  settings.gap = parameters_for(cloud).max_hole_size();
  return settings;
}

std::vector<double> tolerances(const VoxelCloud& cloud) {
  return {0.005, 0.010, parameters_for(cloud).surface_tolerance()};
}

}  // namespace

double natural_spacing(const evaluation::LabelledCloud& cloud) {
  std::vector<double> distances;
  for (std::size_t i = 1; i < cloud.points.size(); ++i) {
    const float distance = (cloud.points[i] - cloud.points[i - 1]).norm();
    if (distance < 0.05F * cloud.points[i].norm()) distances.push_back(distance);
  }
  return percentile(std::move(distances), 0.5);
}

VoxelCloud group_by_voxel(const evaluation::LabelledCloud& cloud, double resolution,
                          const evaluation::LabelOptions& judging) {
  VoxelCloud result;
  result.cloud = &cloud;
  result.resolution = resolution;
  result.judging = judging;
  const geometry::VoxelGrid grid(resolution);
  sensing::Downsampler downsampler(grid);
  const sensing::VoxelScan voxels = downsampler(scan_of(cloud), 0, out_of_sight);
  for (const sensing::EndVoxel& end : voxels.ends) result.centroids.push_back(end.centroid);
  for (const Eigen::Vector3f& point : cloud.points) {
    geometry::VoxelKey key;
    grid.key_of(point, key);
    result.points.push_back(point.cast<double>());
    result.voxel_of.push_back(static_cast<std::size_t>(downsampler.find(key)));
  }
  return result;
}

Parameters parameters_for(const VoxelCloud& cloud) {
  Parameters parameters;
  parameters.occupancy.resolution = cloud.resolution;
  parameters.occupancy.max_range = out_of_sight;
  return parameters;
}

Segmentation segment_ours(const VoxelCloud& cloud, const Parameters& parameters) {
  Segmentation result;
  result.method = "octosurf";
  Mapper mapper(parameters);
  const Scan scan = scan_of(*cloud.cloud);
  result.ms = time_ms([&] {
    mapper.insert(scan);
    mapper.drain();
  });
  result.snapshot = *mapper.snapshot();
  for (const Eigen::Vector3d& point : cloud.points) result.found.push_back(mapper.map().at(point).surface);
  judge(cloud, result);
  return result;
}

Segmentation segment_region_growing(const VoxelCloud& cloud) {
  BestOf best(cloud, "CGAL region growing", cgal_region_growing);
  CgalSettings settings = common_settings(cloud);
  for (const double tolerance : tolerances(cloud))
    for (const double angle_deg : {15, 25}) {
      settings.tolerance = tolerance;
      settings.angle_rad = angle_deg / deg;
      best.try_settings(settings);
    }
  return best.take();
}

Segmentation segment_ransac(const VoxelCloud& cloud) {
  BestOf best(cloud, "CGAL Efficient RANSAC", cgal_efficient_ransac);
  CgalSettings settings = common_settings(cloud);
  for (const double tolerance : tolerances(cloud))
    for (const double normal_threshold : {0.87, 0.95})
      for (const double gap : {2.5 * cloud.resolution, parameters_for(cloud).max_hole_size()}) {
        settings.tolerance = tolerance;
        settings.angle_rad = std::acos(normal_threshold);
        settings.gap = gap;
        best.try_settings(settings);
      }
  return best.take();
}

Segmentation segment_paper(const VoxelCloud& cloud, const Parameters& parameters, const std::string& name) {
  Segmentation result;
  result.method = name;
  result.settings = "the paper's";
  reference::PaperPipeline pipeline(parameters);
  const Scan scan = scan_of(*cloud.cloud);
  result.ms = time_ms([&] { pipeline.insert(scan); });
  result.snapshot = pipeline.snapshot();
  return told_by_polygons(cloud, result, parameters.surface_tolerance());
}

Segmentation told_by_polygons(const VoxelCloud& cloud, const Segmentation& segmentation, double tolerance) {
  Segmentation result = segmentation;
  result.found = by_polygons(result.snapshot, cloud.points, tolerance, cloud.resolution / 2);
  judge(cloud, result);
  return result;
}

std::vector<SurfaceId> by_polygons(const Snapshot& snapshot, const std::vector<Eigen::Vector3d>& points,
                                   double tolerance, double margin) {
  std::vector<SurfaceId> found(points.size(), 0);
  std::vector<double> nearest(points.size(), tolerance);
  for (const SurfacePtr& surface : snapshot.surfaces) {
    const evaluation::PlanarRegion region(surface->polygons);
    const Eigen::Isometry3d to_surface = surface->T_map_surface.inverse();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double distance = std::abs(surface->plane.signed_distance(points[i]));
      if (distance > nearest[i]) continue;
      if (!region.within((to_surface * points[i]).head<2>(), margin)) continue;
      nearest[i] = distance;
      found[i] = surface->id;
    }
  }
  return found;
}

}  // namespace octosurf::bench
