#include "reference/paper_pipeline.hpp"

#include "pcl/steps.hpp"
#include "reference/alpha_shape.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <unordered_set>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::reference {
namespace {

using namespace octosurf::pcl;

/// A surface as the paper stores it (section IV), without colour and mesh.
struct PaperSurface {
  SurfaceId id = 0;
  Plane plane;
  Eigen::Isometry3d T_map_surface = Eigen::Isometry3d::Identity();
  Indices inliers;
  Indices boundary;  ///< inliers that are vertices of the alpha shape
  std::vector<Polygon> polygons;
  OddEven polygon_test;
  double area_m2 = 0;
  std::uint64_t revision = 0;
  bool changed = true;  ///< the derived items have to be computed anew

  Eigen::Vector2d project(const Eigen::Vector3f& point) const {
    return (T_map_surface.inverse() * point.cast<double>()).head<2>();
  }
  double distance(const Eigen::Vector3f& point) const { return plane.signed_distance(point.cast<double>()); }
};

/// Adds the time since its last call to one stage after the other.
class StageClock {
 public:
  explicit StageClock(PaperReport& report) : report_(report) {}
  void lap(PaperStage stage) {
    const auto now = Clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    report_.stage_ms[static_cast<std::size_t>(stage)] += ms;
    report_.total_ms += ms;
    last_ = now;
  }

 private:
  using Clock = std::chrono::steady_clock;
  PaperReport& report_;
  Clock::time_point last_ = Clock::now();
};

/// In order of z, then y, then x.
std::uint64_t voxel_key(const Eigen::Vector3f& point, double resolution) {
  constexpr std::int64_t middle = 1 << 20;
  std::uint64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(static_cast<double>(point[axis]) / resolution));
    key = key << 21 | (static_cast<std::uint64_t>(cell + middle) & 0x1FFFFF);
  }
  return key;
}

/// z is the plane's normal, the origin the foot of the perpendicular from `near`.
Eigen::Isometry3d plane_frame(const Plane& plane, const Eigen::Vector3d& near) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), plane.normal).toRotationMatrix();
  T.translation() = near - plane.signed_distance(near) * plane.normal;
  return T;
}

/// The scan's points in range, map frame.
Points in_map_frame(const Scan& scan, const OccupancyParameters& occupancy) {
  const bool depth = scan.sensor == SensorKind::depth_camera;
  const double max_range =
      occupancy.max_range.value_or(depth ? 4.0 : std::numeric_limits<double>::infinity());
  Points points;
  points.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    if (!point.allFinite()) continue;
    const double range = point.cast<double>().norm();
    if (range > max_range || range < occupancy.min_range) continue;
    points.push_back((scan.T_map_sensor * point.cast<double>()).cast<float>());
  }
  return points;
}

/// pcl::VoxelGrid: a centroid per voxel. Throws Error(data) naming `where` if the points span more
/// voxels than PCL can number (it would hand them back as they were).
Points voxel_centroids(const Points& points, double edge, const std::string& where);

Points voxel_centroids(const Points& points, double edge, const std::string& where) {
  if (points.empty()) return {};
  Eigen::Array3f low = points.front(), high = low;
  for (const Eigen::Vector3f& point : points) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  if (((high - low).cast<double>() / edge + 1).prod() > std::numeric_limits<std::int32_t>::max())
    throw Error(Error::Kind::data, where, "spans more voxels than pcl::VoxelGrid can number",
                "set max_range or a coarser resolution");
  const auto cloud = std::make_shared<::pcl::PointCloud<::pcl::PointXYZ>>();
  for (const Eigen::Vector3f& point : points) cloud->emplace_back(point.x(), point.y(), point.z());
  ::pcl::VoxelGrid<::pcl::PointXYZ> grid;
  grid.setLeafSize(Eigen::Vector4f::Constant(static_cast<float>(edge)));
  grid.setInputCloud(cloud);
  ::pcl::PointCloud<::pcl::PointXYZ> centroids;
  grid.filter(centroids);
  Points result;
  for (const auto& point : centroids) result.push_back(point.getVector3fMap());
  return result;
}

/// Downsampled points in the map frame, and from each the way to the sensor.
struct Viewed {
  Points points, views;
};

/// Those of `from` that `which` names.
template <typename Element, typename Index>
std::vector<Element> pick(const std::vector<Element>& from, const std::vector<Index>& which) {
  std::vector<Element> picked;
  picked.reserve(which.size());
  for (const Index i : which) picked.push_back(from[i]);
  return picked;
}

/// Those of `all` that `which` does not name; `which` holds positions in `all`, ascending.
Indices without(const Indices& all, const Indices& which) {
  Indices rest;
  for (std::uint32_t position = 0; position < all.size(); ++position)
    if (!std::binary_search(which.begin(), which.end(), position)) rest.push_back(all[position]);
  return rest;
}

}  // namespace

struct PaperPipeline::Impl {
  double d, s, h, r;
  std::size_t n;
  OccupancyParameters occupancy;
  DetectionParameters detection;

  Points points;  ///< everything that ever passed change detection
  Points views;   ///< toward the sensor, same order
  std::unordered_set<std::uint64_t> seen;
  std::vector<PaperSurface> surfaces;
  Indices accumulated;
  std::size_t outliers = 0;
  SurfaceId last_id = 0;
  std::uint64_t revision = 0;

  explicit Impl(const Parameters& parameters)
      : d(parameters.occupancy.resolution),
        s(parameters.surface_tolerance()),
        h(parameters.max_hole_size()),
        r(parameters.search_radius()),
        n(static_cast<std::size_t>(parameters.min_surface_points())),
        occupancy(parameters.occupancy),
        detection(parameters.detection) {}

  /// III-A1.
  Viewed downsample(const Scan& scan) const {
    require_rigid(scan.T_map_sensor, scan.name);
    Viewed viewed;
    viewed.points = voxel_centroids(in_map_frame(scan, occupancy), d, scan.name);
    const Eigen::Vector3f sensor = scan.T_map_sensor.translation().cast<float>();
    for (const Eigen::Vector3f& point : viewed.points) viewed.views.push_back(sensor - point);
    return viewed;
  }

  /// III-B: "ordered by size", largest first.
  std::vector<PaperSurface*> by_size() {
    std::vector<PaperSurface*> order;
    for (PaperSurface& surface : surfaces) order.push_back(&surface);
    std::stable_sort(order.begin(), order.end(), [](const PaperSurface* a, const PaperSurface* b) {
      return a->inliers.size() > b->inliers.size();
    });
    return order;
  }

  /// III-A2. Appends to `fresh` what is in voxels never seen before.
  void change_detection(const Points& candidates, const Points& toward_sensor, Indices& fresh) {
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (!seen.insert(voxel_key(candidates[i], d)).second) continue;
      fresh.push_back(static_cast<std::uint32_t>(points.size()));
      points.push_back(candidates[i]);
      views.push_back(toward_sensor[i]);
    }
  }

  /// III-B1. Takes the inliers out of `cloud`.
  void add_inliers(Indices& cloud) {
    for (PaperSurface* surface : by_size()) {
      const auto outside = std::stable_partition(cloud.begin(), cloud.end(), [&](std::uint32_t i) {
        return std::abs(surface->distance(points[i])) > s ||
               !surface->polygon_test.contains(surface->project(points[i]));
      });
      surface->inliers.insert(surface->inliers.end(), outside, cloud.end());
      cloud.erase(outside, cloud.end());
    }
  }

  /// III-B2, Algorithm 1. Takes what it adds out of `cloud`.
  void expand(Indices& cloud) {
    if (cloud.empty() || surfaces.empty()) return;
    RadiusSearch tree(pick(points, cloud));
    std::vector<bool> taken(cloud.size(), false);
    for (PaperSurface* surface : by_size()) {
      Indices boundary = surface->boundary;
      for (std::size_t next = 0; next < boundary.size(); ++next) {
        for (const std::uint32_t j : tree.within(points[boundary[next]], h)) {
          if (taken[j] || std::abs(surface->distance(points[cloud[j]])) > s) continue;
          taken[j] = true;
          boundary.push_back(cloud[j]);
          surface->inliers.push_back(cloud[j]);
          surface->changed = true;
        }
      }
    }
    std::size_t kept = 0;
    for (std::size_t j = 0; j < cloud.size(); ++j)
      if (!taken[j]) cloud[kept++] = cloud[j];
    cloud.resize(kept);
  }

  /// III-C1: joins `cloud` to what is pending, in order of the voxels, and drops points without two
  /// neighbours within r.
  void accumulate(const Indices& cloud) {
    accumulated.insert(accumulated.end(), cloud.begin(), cloud.end());
    std::sort(accumulated.begin(), accumulated.end(), [&](std::uint32_t a, std::uint32_t b) {
      return voxel_key(points[a], d) < voxel_key(points[b], d);
    });
    const Indices kept = with_neighbors(pick(points, accumulated), r, 2);
    outliers += accumulated.size() - kept.size();
    accumulated = pick(accumulated, kept);
  }

  /// III-C4, Algorithm 2's inner loops: planes while a region has more than n points, each split
  /// into clusters by h; `found(plane, cluster)` for clusters over n.
  template <typename Found>
  void extract_planes(Indices region, Found found) const {
    while (region.size() > n) {
      const PlaneFit fit = fit_plane(pick(points, region), s, detection.ransac_iterations);
      if (fit.inliers.empty()) return;
      const Indices inliers = pick(region, fit.inliers);
      region = without(region, fit.inliers);
      for (const Indices& cluster : clusters(pick(points, inliers), h, n + 1))
        found(fit.plane, pick(inliers, cluster));
    }
  }

  void add_surface(Plane plane, Indices inliers) {
    Eigen::Vector3d toward_sensor = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : inliers) toward_sensor += views[i].normalized().cast<double>();
    if (plane.normal.dot(toward_sensor) < 0) plane = {-plane.normal, -plane.offset};
    PaperSurface surface;
    surface.id = ++last_id;
    surface.plane = plane;
    surface.T_map_surface = plane_frame(plane, points[inliers.front()].cast<double>());
    surface.inliers = std::move(inliers);
    surfaces.push_back(std::move(surface));
  }

  /// III-C, Algorithm 2, on all that is accumulated. What is in no new surface stays accumulated.
  void detect(StageClock& clock) {
    if (accumulated.size() <= n) return;
    const auto normals = mls_normals(pick(points, accumulated), r);
    Indices with_normal;
    for (const PointNormal& normal : normals) with_normal.push_back(accumulated[normal.point]);
    clock.lap(PaperStage::normals);
    const auto regions = smooth_regions(pick(points, with_normal), normals, detection.smoothness_angle,
                                        detection.max_curvature, n);
    clock.lap(PaperStage::regions);
    std::unordered_set<std::uint32_t> placed;
    for (const Indices& region : regions)
      extract_planes(pick(with_normal, region), [&](const Plane& plane, Indices inliers) {
        placed.insert(inliers.begin(), inliers.end());
        add_surface(plane, std::move(inliers));
      });
    std::erase_if(accumulated, [&placed](std::uint32_t i) { return placed.contains(i); });
    clock.lap(PaperStage::planes);
  }

  /// IV-A, Algorithm 3.
  void derive(PaperSurface& surface) const {
    std::vector<Eigen::Vector2d> projected;
    projected.reserve(surface.inliers.size());
    for (const std::uint32_t i : surface.inliers) projected.push_back(surface.project(points[i]));
    AlphaShape shape = alpha_shape(projected, h);
    surface.polygons = std::move(shape.polygons);
    surface.polygon_test = OddEven(surface.polygons, h);
    surface.area_m2 = shape.area_m2;
    surface.boundary.clear();
    for (const std::uint32_t j : shape.boundary) surface.boundary.push_back(surface.inliers[j]);
    surface.revision = revision;
    surface.changed = false;
  }

  void run(const Points& candidates, const Points& toward_sensor, PaperReport& report, StageClock& clock) {
    ++revision;
    Indices cloud;
    change_detection(candidates, toward_sensor, cloud);
    report.points_new = cloud.size();
    const std::size_t first_new = points.size() - cloud.size();
    clock.lap(PaperStage::change_detection);
    add_inliers(cloud);
    clock.lap(PaperStage::add_inliers);
    expand(cloud);
    clock.lap(PaperStage::expand);
    const std::size_t outliers_before = outliers;
    accumulate(cloud);
    report.outliers = outliers - outliers_before;
    clock.lap(PaperStage::accumulate);
    detect(clock);
    for (PaperSurface& surface : surfaces)
      if (surface.changed) derive(surface);
    clock.lap(PaperStage::derive);
    for (const PaperSurface& surface : surfaces)
      report.categorized +=
          static_cast<std::size_t>(std::count_if(surface.inliers.begin(), surface.inliers.end(),
                                                 [first_new](std::uint32_t i) { return i >= first_new; }));
  }
};

PaperPipeline::PaperPipeline(const Parameters& parameters) {
  parameters.validate();
  impl_ = std::make_unique<Impl>(parameters);
}
PaperPipeline::PaperPipeline(PaperPipeline&&) noexcept = default;
PaperPipeline& PaperPipeline::operator=(PaperPipeline&&) noexcept = default;
PaperPipeline::~PaperPipeline() = default;

PaperReport PaperPipeline::insert(const Scan& scan) {
  PaperReport report;
  StageClock clock(report);
  const Viewed viewed = impl_->downsample(scan);
  report.points_raw = scan.points.size();
  report.voxels = viewed.points.size();
  clock.lap(PaperStage::downsample);
  impl_->run(viewed.points, viewed.views, report, clock);
  return report;
}

void PaperPipeline::collect(const Scan& scan) {
  const Viewed viewed = impl_->downsample(scan);
  impl_->change_detection(viewed.points, viewed.views, impl_->accumulated);
}

PaperReport PaperPipeline::detect_collected() { return insert_points({}, {}); }

PaperReport PaperPipeline::insert_points(const std::vector<Eigen::Vector3f>& points,
                                         const std::vector<Eigen::Vector3f>& views) {
  if (points.size() != views.size())
    throw Error(Error::Kind::usage, "insert_points", "points and views differ in number");
  PaperReport report;
  report.points_raw = report.voxels = points.size();
  StageClock clock(report);
  impl_->run(points, views, report, clock);
  return report;
}

Snapshot PaperPipeline::snapshot() const {
  Snapshot snapshot;
  snapshot.revision = impl_->revision;
  snapshot.resolution = impl_->d;
  for (const PaperSurface& from : impl_->surfaces) {
    auto surface = std::make_shared<Surface>();
    surface->id = from.id;
    surface->plane = from.plane;
    surface->T_map_surface = from.T_map_surface;
    surface->polygons = from.polygons;
    for (const std::uint32_t i : from.boundary)
      surface->boundary.push_back(surface->to_map(from.project(impl_->points[i])));
    surface->area_m2 = from.area_m2;
    surface->inliers = from.inliers.size();
    double squares = 0;
    for (const std::uint32_t i : from.inliers) squares += std::pow(from.distance(impl_->points[i]), 2);
    surface->rms_m = std::sqrt(squares / static_cast<double>(from.inliers.size()));
    surface->revision = from.revision;
    snapshot.surfaces.push_back(std::move(surface));
  }
  return snapshot;
}

std::size_t PaperPipeline::pending() const { return impl_->accumulated.size(); }
std::size_t PaperPipeline::outliers() const { return impl_->outliers; }

Snapshot paper_pipeline_offline(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<Eigen::Vector3f>& views, const Parameters& parameters) {
  PaperPipeline pipeline(parameters);
  pipeline.insert_points(points, views);
  return pipeline.snapshot();
}

Parameters paper_parameters(double resolution) {
  Parameters parameters = Parameters::paper();
  parameters.occupancy.resolution = resolution;
  // s follows d (III-B1); Parameters::paper() states it for its own d.
  parameters.surfaces.surface_tolerance = parameters.surfaces.sensor_noise + resolution * std::sqrt(3.0);
  return parameters;
}

Parameters paper_parameters_small_radius(double resolution) {
  Parameters parameters = paper_parameters(resolution);
  parameters.detection.search_radius = parameters.detection.normal_radius = 0.06;
  return parameters;
}

}  // namespace octosurf::reference
