#include "bench/bench.hpp"
#include "geometry/moments.hpp"
#include "geometry/rings.hpp"
#include "pcl/steps.hpp"
#include "sensing/downsample.hpp"
#include "support/alpha_shape_twin.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Random.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>
#include <CGAL/version.h>
#include <boost/property_map/function_property_map.hpp>
#include <numeric>
#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>
#include <tsl/robin_set.h>
#include <tuple>
// CGAL 6 (Debian 13) has moved it and made it speak of items instead of places in a range.
#if CGAL_VERSION_NR >= 1060000000
#include <CGAL/Shape_detection/Region_growing/Point_set.h>
#else
#include <CGAL/Shape_detection/Region_growing/Region_growing_on_point_set.h>
#endif

namespace octosurf::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// Point, normal, and which of the points it is: Efficient RANSAC sorts its input anew.
using PointNormal = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
using PointNormals = std::vector<PointNormal>;
using PointMap = CGAL::Nth_of_tuple_property_map<0, PointNormal>;
using NormalMap = CGAL::Nth_of_tuple_property_map<1, PointNormal>;
using Regions = std::vector<std::vector<std::size_t>>;

constexpr unsigned normal_neighbours = 24, growing_neighbours = 12;
constexpr std::size_t fewest_points = 30;

#if CGAL_VERSION_NR >= 1060000000
template <std::size_t part>
struct PartOf {
  const PointNormals* cloud = nullptr;
  const std::tuple_element_t<part, PointNormal>& operator()(std::size_t i) const {
    return std::get<part>((*cloud)[i]);
  }
};
template <std::size_t part>
using PartMap =
    boost::function_property_map<PartOf<part>, std::size_t, const std::tuple_element_t<part, PointNormal>&>;

Regions grow_regions(PointNormals& cloud, const CgalSettings& settings) {
  namespace point_set = CGAL::Shape_detection::Point_set;
  using Query = point_set::K_neighbor_query<Kernel, std::size_t, PartMap<0>>;
  using Region = point_set::Least_squares_plane_fit_region<Kernel, std::size_t, PartMap<0>, PartMap<1>>;
  std::vector<std::size_t> items(cloud.size());
  std::iota(items.begin(), items.end(), std::size_t{0});
  const PartMap<0> points(PartOf<0>{&cloud});
  Query query(items, CGAL::parameters::k_neighbors(growing_neighbours).point_map(points));
  Region region(CGAL::parameters::maximum_distance(settings.tolerance)
                    .maximum_angle(settings.angle_rad * 180 / CGAL_PI)
                    .minimum_region_size(settings.min_points)
                    .point_map(points)
                    .normal_map(PartMap<1>(PartOf<1>{&cloud})));
  Regions regions;
  CGAL::Shape_detection::Region_growing<Query, Region> growing(items, query, region);
  std::vector<decltype(growing)::Primitive_and_region> found;
  growing.detect(std::back_inserter(found));
  for (auto& [plane, indices] : found) regions.push_back(std::move(indices));
  return regions;
}
#else
Regions grow_regions(PointNormals& cloud, const CgalSettings& settings) {
  namespace point_set = CGAL::Shape_detection::Point_set;
  using Query = point_set::K_neighbor_query<Kernel, PointNormals, PointMap>;
  using Region = point_set::Least_squares_plane_fit_region<Kernel, PointNormals, PointMap, NormalMap>;
  Query query(cloud, growing_neighbours);
  Region region(cloud, settings.tolerance, settings.angle_rad * 180 / CGAL_PI, settings.min_points);
  Regions regions;
  CGAL::Shape_detection::Region_growing<PointNormals, Query, Region> growing(cloud, query, region);
  growing.detect(std::back_inserter(regions));
  return regions;
}
#endif

Regions draw_planes(PointNormals& cloud, const CgalSettings& settings) {
  using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, PointNormals, PointMap, NormalMap>;
  using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
  CGAL::get_default_random() = CGAL::Random(1);
  Ransac ransac;
  ransac.set_input(cloud);
  ransac.add_shape_factory<CGAL::Shape_detection::Plane<Traits>>();
  Ransac::Parameters chosen;  // probability: CGAL's default
  chosen.min_points = settings.min_points;
  chosen.epsilon = settings.tolerance;
  chosen.cluster_epsilon = settings.gap;
  chosen.normal_threshold = std::cos(settings.angle_rad);
  ransac.detect(chosen);
  Regions regions;
  for (const auto& shape : ransac.shapes()) regions.push_back(shape->indices_of_assigned_points());
  return regions;
}

template <class FindPlanes>
CgalPlanes find(const std::vector<Eigen::Vector3f>& points, const FindPlanes& find_planes) {
  PointNormals cloud;
  cloud.reserve(points.size());
  for (const Eigen::Vector3f& p : points)
    cloud.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()), Kernel::Vector_3(), cloud.size());
  CgalPlanes found;
  if (cloud.size() < fewest_points) return found;
  found.ms = time_ms([&] {
    CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
        cloud, normal_neighbours, CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
    found.regions = find_planes(cloud);
  });
  for (auto& region : found.regions)
    for (std::size_t& i : region) i = std::get<2>(cloud[i]);
  return found;
}

}  // namespace

CgalPlanes cgal_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings) {
  return find(points, [&](PointNormals& cloud) { return grow_regions(cloud, settings); });
}

CgalPlanes cgal_efficient_ransac(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings) {
  return find(points, [&](PointNormals& cloud) { return draw_planes(cloud, settings); });
}

CgalPlanes pcl_region_growing(const std::vector<Eigen::Vector3f>& points, const CgalSettings& settings) {
  constexpr float curvature = 0.05F;  // the paper's
  CgalPlanes result;
  result.ms = time_ms([&] {
    const auto cloud = std::make_shared<::pcl::PointCloud<::pcl::PointXYZ>>();
    for (const Eigen::Vector3f& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
    const auto tree = std::make_shared<::pcl::search::KdTree<::pcl::PointXYZ>>();
    const auto normals = std::make_shared<::pcl::PointCloud<::pcl::Normal>>();
    ::pcl::NormalEstimation<::pcl::PointXYZ, ::pcl::Normal> estimation;
    estimation.setInputCloud(cloud);
    estimation.setSearchMethod(tree);
    estimation.setKSearch(normal_neighbours);
    estimation.compute(*normals);
    ::pcl::RegionGrowing<::pcl::PointXYZ, ::pcl::Normal> growing;
    growing.setInputCloud(cloud);
    growing.setInputNormals(normals);
    growing.setSearchMethod(tree);
    growing.setNumberOfNeighbours(growing_neighbours);
    growing.setMinClusterSize(static_cast<int>(settings.min_points));
    growing.setSmoothnessThreshold(static_cast<float>(settings.angle_rad));
    growing.setCurvatureThreshold(curvature);
    std::vector<::pcl::PointIndices> clusters;
    growing.extract(clusters);
    for (const ::pcl::PointIndices& cluster : clusters)
      result.regions.emplace_back(cluster.indices.begin(), cluster.indices.end());
  });
  return result;
}

std::shared_ptr<Surface> surface_of(SurfaceId id, const std::vector<Eigen::Vector3f>& points,
                                    const std::vector<std::size_t>& indices) {
  const Eigen::Vector3d reference = points[indices.front()].cast<double>();
  geometry::Moments moments;
  for (const std::size_t i : indices) moments.add(points[i].cast<double>() - reference);
  const geometry::PlaneFit fit = geometry::fit_plane(moments);
  auto surface = std::make_shared<Surface>();
  surface->id = id;
  surface->T_map_surface.translation() = reference + fit.centroid;
  surface->plane = {fit.normal, fit.normal.dot(reference + fit.centroid)};
  surface->inliers = indices.size();
  return surface;
}

std::pair<Snapshot, double> cgal_surfaces(CgalMethod method, const std::vector<Scan>& scans,
                                          const Parameters& parameters) {
  sensing::Downsampler downsampler{geometry::VoxelGrid(parameters.occupancy.resolution)};
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen;
  std::vector<Eigen::Vector3f> points, views;
  for (const Scan& scan : scans) {
    const double range = parameters.occupancy.max_range.value_or(sensing::default_max_range(scan.sensor));
    const sensing::VoxelScan voxels = downsampler(scan, 0, range);
    for (const sensing::EndVoxel& end : voxels.ends) {
      if ((end.centroid - voxels.origin).norm() > range || !seen.insert(end.key.packed()).second) continue;
      points.push_back(end.centroid);
      views.emplace_back((voxels.origin - end.centroid).normalized());
    }
  }
  const CgalPlanes planes =
      method(points, {parameters.surface_tolerance(), pcl::smoothness_angle, parameters.max_hole_size(),
                      static_cast<std::size_t>(parameters.min_surface_points())});
  Snapshot snapshot;
  snapshot.resolution = parameters.occupancy.resolution;
  for (const std::vector<std::size_t>& region : planes.regions) {
    const auto surface = surface_of(static_cast<SurfaceId>(snapshot.surfaces.size() + 1), points, region);
    Eigen::Vector3f view = Eigen::Vector3f::Zero();
    for (const std::size_t i : region) view += views[i];
    Plane& plane = surface->plane;
    if (plane.normal.dot(view.cast<double>()) < 0) plane = {-plane.normal, -plane.offset};
    surface->T_map_surface.linear() =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), plane.normal).toRotationMatrix();
    const Eigen::Isometry3d to_plane = surface->T_map_surface.inverse();
    std::vector<Eigen::Vector2d> projected;
    for (const std::size_t i : region) projected.push_back((to_plane * points[i].cast<double>()).head<2>());
    surface->polygons = alpha_shape(projected, parameters.max_hole_size());
    for (const Polygon& polygon : surface->polygons) surface->area_m2 += geometry::area_of(polygon);
    snapshot.surfaces.push_back(surface);
  }
  return {std::move(snapshot), planes.ms};
}

}  // namespace octosurf::bench
