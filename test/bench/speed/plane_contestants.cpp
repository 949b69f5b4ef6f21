// CGAL's planes: region growing and Efficient RANSAC on the voxels of one scan, or of many.

#include "bench/cgal_planes.hpp"
#include "bench/speed/contestant.hpp"
#include "bench/support.hpp"
#include "reference/alpha_shape.hpp"
#include "sensing/downsample.hpp"

#include <Eigen/Geometry>
#include <tsl/robin_set.h>
#include <utility>

namespace octosurf::bench {
namespace {

using FindPlanes = CgalPlanes (*)(const std::vector<Eigen::Vector3f>&, const CgalSettings&);

/// Both methods: voxel centroids in, regions out; s, h, n and the angle are octosurf's defaults.
class CgalSide : public Contestant {
 public:
  CgalSide(FindPlanes find_planes, const Json& settings)
      : find_planes_(find_planes),
        parameters_(parameters_from(settings)),
        accumulate_(settings.value("accumulate", false)),
        max_range_(max_range_of(settings)),
        downsampler_(geometry::VoxelGrid(parameters_.occupancy.resolution)) {}

  /// The centroid per voxel that octosurf starts from, too; accumulated: of the first scan in it.
  void prepare(const Scan& scan) override {
    if (!accumulate_) {
      points_.clear();
      views_.clear();
      seen_.clear();
    }
    const sensing::VoxelScan voxels = downsampler_(scan, 0, max_range_);
    for (const sensing::EndVoxel& end : voxels.ends) {
      if ((end.centroid - voxels.origin).norm() > max_range_ || !seen_.insert(end.key.packed()).second)
        continue;
      points_.push_back(end.centroid);
      views_.emplace_back((voxels.origin - end.centroid).normalized());
    }
  }

  void run() override {
    CgalSettings settings;
    settings.tolerance = parameters_.surface_tolerance();
    settings.angle_rad = parameters_.detection.smoothness_angle;
    settings.gap = parameters_.max_hole_size();
    settings.min_points = static_cast<std::size_t>(parameters_.min_surface_points());
    CgalPlanes planes = find_planes_(points_, settings);
    regions_ = std::move(planes.regions);
    normals_ms_ = planes.normals_ms;
  }
  Json stages() const override { return {normals_ms_}; }

  /// {"evaluate": TRUTH FILE}: scores of the planes with the reference's alpha shape as outline.
  Json tell(const Json& question) override {
    Json answer{{"points", points_.size()}, {"surfaces", regions_.size()}};
    if (question.contains("evaluate")) answer.update(scores(snapshot(), question));
    return answer;
  }

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
    const FittedPlane fitted = least_squares_plane(points_, region);
    Eigen::Vector3f view = Eigen::Vector3f::Zero();
    for (const std::size_t i : region) view += views_[i];
    auto surface = std::make_shared<Surface>();
    surface->id = id;
    surface->plane = fitted.plane;
    if (fitted.plane.normal.dot(view.cast<double>()) < 0) {
      surface->plane.normal *= -1;
      surface->plane.offset *= -1;
    }
    surface->T_map_surface.linear() =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), surface->plane.normal)
            .toRotationMatrix();
    surface->T_map_surface.translation() = fitted.centroid;
    const Eigen::Isometry3d to_plane = surface->T_map_surface.inverse();
    std::vector<Eigen::Vector2d> projected;
    for (const std::size_t i : region) projected.push_back((to_plane * points_[i].cast<double>()).head<2>());
    reference::AlphaShape shape = reference::alpha_shape(projected, parameters_.max_hole_size());
    surface->area_m2 = shape.area_m2;
    surface->polygons = std::move(shape.polygons);
    surface->inliers = region.size();
    return surface;
  }

  FindPlanes find_planes_;
  Parameters parameters_;
  bool accumulate_;
  double max_range_;
  sensing::Downsampler downsampler_;
  std::vector<Eigen::Vector3f> points_, views_;
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen_;
  std::vector<std::vector<std::size_t>> regions_;
  double normals_ms_ = 0;
};

}  // namespace

std::unique_ptr<Contestant> make_region_growing(const Json& settings) {
  return std::make_unique<CgalSide>(cgal_region_growing, settings);
}
std::unique_ptr<Contestant> make_ransac(const Json& settings) {
  return std::make_unique<CgalSide>(cgal_efficient_ransac, settings);
}

}  // namespace octosurf::bench
