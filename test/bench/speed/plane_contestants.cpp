// CGAL's planes: region growing and Efficient RANSAC on the voxels of one scan, or of many.

#include "bench/speed/contestant.hpp"
#include "occupancy/downsample.hpp"
#include "reference/alpha_shape.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing_on_point_set.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <tsl/robin_set.h>
#include <tuple>

namespace octosurf::bench {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
/// Point, normal, and which of the points it is: Efficient RANSAC sorts its input anew.
using PointNormal = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
using PointNormals = std::vector<PointNormal>;
using PointMap = CGAL::Nth_of_tuple_property_map<0, PointNormal>;
using NormalMap = CGAL::Nth_of_tuple_property_map<1, PointNormal>;
using Regions = std::vector<std::vector<std::size_t>>;

constexpr unsigned normal_neighbours = 24;
constexpr unsigned growing_neighbours = 12;  // as in CGAL's manual
constexpr std::size_t fewest_points = 30;

/// Both methods: voxel centroids in, regions out; s, h, n and the angle are octosurf's defaults.
class CgalSide : public Contestant {
 public:
  explicit CgalSide(const Json& settings)
      : parameters_(parameters_from(settings)),
        accumulate_(settings.value("accumulate", false)),
        max_range_(max_range_of(settings)),
        downsampler_(VoxelGrid(parameters_.occupancy.resolution)) {}

  /// The centroid per voxel that octosurf starts from, too; accumulated: of the first scan in it.
  void prepare(const Scan& scan) override {
    if (!accumulate_) {
      points_.clear();
      views_.clear();
      seen_.clear();
    }
    const VoxelScan voxels = downsampler_(scan, 0, max_range_);
    for (const EndVoxel& end : voxels.ends) {
      if ((end.centroid - voxels.origin).norm() > max_range_ || !seen_.insert(end.key.packed()).second)
        continue;
      points_.push_back(end.centroid);
      views_.emplace_back((voxels.origin - end.centroid).normalized());
    }
  }

  void run() override {
    cloud_.clear();
    regions_.clear();
    for (const Eigen::Vector3f& p : points_)
      cloud_.emplace_back(Kernel::Point_3(p.x(), p.y(), p.z()), Kernel::Vector_3(), cloud_.size());
    if (cloud_.size() < fewest_points) return;
    const auto start = std::chrono::steady_clock::now();
    CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
        cloud_, normal_neighbours, CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
    normals_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    regions_ = find_planes(cloud_);
    for (auto& region : regions_)
      for (std::size_t& i : region) i = std::get<2>(cloud_[i]);
  }
  Json stages() const override { return {normals_ms_}; }

  /// {"evaluate": TRUTH FILE}: scores of the planes with the reference's alpha shape as outline.
  Json tell(const Json& question) override {
    Json answer{{"points", points_.size()}, {"surfaces", regions_.size()}};
    if (question.contains("evaluate")) answer.update(scores(snapshot(), question));
    return answer;
  }

 protected:
  virtual Regions find_planes(PointNormals& cloud) = 0;
  const Parameters& parameters() const { return parameters_; }

 private:
  Snapshot snapshot() const {
    Snapshot snapshot;
    snapshot.resolution = parameters_.occupancy.resolution;
    for (const auto& region : regions_)
      snapshot.surfaces.push_back(surface_of(region, static_cast<SurfaceId>(snapshot.surfaces.size() + 1)));
    return snapshot;
  }

  /// Least-squares plane of the region, toward where it was seen from.
  SurfacePtr surface_of(const std::vector<std::size_t>& region, SurfaceId id) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), view = Eigen::Vector3d::Zero();
    for (const std::size_t i : region) {
      mean += points_[i].cast<double>() / static_cast<double>(region.size());
      view += views_[i].cast<double>();
    }
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const std::size_t i : region) {
      const Eigen::Vector3d v = points_[i].cast<double>() - mean;
      scatter += v * v.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
    auto surface = std::make_shared<Surface>();
    surface->id = id;
    surface->plane.normal = solver.eigenvectors().col(0).normalized();
    if (surface->plane.normal.dot(view) < 0) surface->plane.normal *= -1;
    surface->plane.offset = surface->plane.normal.dot(mean);
    surface->T_map_surface.linear() =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), surface->plane.normal)
            .toRotationMatrix();
    surface->T_map_surface.translation() = mean;
    const Eigen::Isometry3d to_plane = surface->T_map_surface.inverse();
    std::vector<Eigen::Vector2d> projected;
    for (const std::size_t i : region) projected.push_back((to_plane * points_[i].cast<double>()).head<2>());
    reference::AlphaShape shape = reference::alpha_shape(projected, parameters_.max_hole_size());
    surface->area_m2 = shape.area_m2;
    surface->polygons = std::move(shape.polygons);
    surface->inliers = region.size();
    return surface;
  }

  Parameters parameters_;
  bool accumulate_;
  double max_range_;
  Downsampler downsampler_;
  std::vector<Eigen::Vector3f> points_, views_;
  tsl::robin_set<std::uint64_t, PackedKeyHash> seen_;
  PointNormals cloud_;
  Regions regions_;
  double normals_ms_ = 0;
};

class RegionGrowingSide : public CgalSide {
 public:
  using CgalSide::CgalSide;

 protected:
  Regions find_planes(PointNormals& cloud) override {
    namespace point_set = CGAL::Shape_detection::Point_set;
    using Query = point_set::K_neighbor_query<Kernel, PointNormals, PointMap>;
    using Region = point_set::Least_squares_plane_fit_region<Kernel, PointNormals, PointMap, NormalMap>;
    Query query(cloud, growing_neighbours);
    Region region(cloud, parameters().surface_tolerance(),
                  parameters().detection.smoothness_angle * 180 / CGAL_PI,
                  static_cast<std::size_t>(parameters().min_surface_points()));
    Regions regions;
    CGAL::Shape_detection::Region_growing<PointNormals, Query, Region> growing(cloud, query, region);
    growing.detect(std::back_inserter(regions));
    return regions;
  }
};

class RansacSide : public CgalSide {
 public:
  using CgalSide::CgalSide;

 protected:
  Regions find_planes(PointNormals& cloud) override {
    using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, PointNormals, PointMap, NormalMap>;
    using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
    Ransac ransac;
    ransac.set_input(cloud);
    ransac.add_shape_factory<CGAL::Shape_detection::Plane<Traits>>();
    Ransac::Parameters chosen;  // probability: CGAL's default
    chosen.min_points = static_cast<std::size_t>(parameters().min_surface_points());
    chosen.epsilon = parameters().surface_tolerance();
    chosen.cluster_epsilon = parameters().max_hole_size();
    chosen.normal_threshold = std::cos(parameters().detection.smoothness_angle);
    ransac.detect(chosen);
    Regions regions;
    for (const auto& shape : ransac.shapes()) regions.push_back(shape->indices_of_assigned_points());
    return regions;
  }
};

}  // namespace

std::unique_ptr<Contestant> make_region_growing(const Json& settings) {
  return std::make_unique<RegionGrowingSide>(settings);
}
std::unique_ptr<Contestant> make_ransac(const Json& settings) {
  return std::make_unique<RansacSide>(settings);
}

}  // namespace octosurf::bench
