// Parts of the surfaces' work: normals, and the outline of a surface that grows.

#include "bench/speed/speed.hpp"
#include "bench/support.hpp"
#include "occupancy/occupancy_map.hpp"
#include "occupancy/point_window.hpp"
#include "pcl/steps.hpp"
#include "reference/alpha_shape.hpp"
#include "simulation/random.hpp"
#include "surfaces/normal_field.hpp"
#include "surfaces/surface_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace octosurf::bench {
namespace {

constexpr double resolution = 0.02;  // m

/// The octree of one scan.
occupancy::OccupancyMap octree_of(const Scan& scan) {
  occupancy::OccupancyMap map(parameters_at(resolution).occupancy);
  sensing::Downsampler downsampler(map.grid());
  map.insert(downsampler(scan, 0, camera_range), downsampler, nullptr);
  return map;
}

pcl::Points points_of(const occupancy::OccupancyMap& map) {
  pcl::Points points;
  map.for_each_point([&](const occupancy::VoxelPoint& point) { points.push_back(point.position); });
  return points;
}

std::vector<surfaces::LocalPlane> field_normals(occupancy::OccupancyMap& map,
                                                const std::vector<geometry::VoxelKey>& keys, double radius) {
  Parameters parameters = parameters_at(resolution);
  // Both ends at one radius: no widening, which the incumbent does not have either.
  parameters.detection.normal_radius = parameters.detection.search_radius = radius;
  const sensing::NoiseModel noise(parameters);
  const surfaces::SurfaceStore no_surfaces(resolution);  // every neighbour counts
  occupancy::PointWindow window(map);
  surfaces::NormalField field(window, parameters, noise, no_surfaces);
  std::vector<surfaces::LocalPlane> planes;
  for (const geometry::VoxelKey key : keys) planes.push_back(field.at(window.find(key)));
  return planes;
}

/// Appends degrees between normals of points that PCL finds planar; its normals have no side.
void collect_angles(const std::vector<surfaces::LocalPlane>& ours,
                    const std::vector<pcl::PointNormal>& theirs, std::vector<double>& angles) {
  constexpr double planar = 0.01;  // surface variation
  for (const pcl::PointNormal& their : theirs) {
    const surfaces::LocalPlane& our = ours.at(their.point);
    if (!our.known || their.curvature > planar) continue;
    const double cosine =
        our.normal.cast<double>().normalized().dot(their.normal.cast<double>().normalized());
    angles.push_back(std::acos(std::min(1.0, std::abs(cosine))) * 180 / std::numbers::pi);
  }
}

void normal_field(benchmark::State& state, const Scans& scans, double radius) {
  std::optional<occupancy::OccupancyMap> map;
  std::vector<geometry::VoxelKey> keys;
  std::vector<double> angles;
  std::vector<surfaces::LocalPlane> normals;
  double points = 0, known = 0;
  const auto compare = [&] {  // with PCL's of the scan before, not timed
    if (!map) return;
    collect_angles(normals, pcl::mls_normals(points_of(*map), radius), angles);
    points += static_cast<double>(normals.size());
    known +=
        static_cast<double>(std::count_if(normals.begin(), normals.end(), [](auto& n) { return n.known; }));
  };
  for_each(
      state, scans,
      [&](const Scan& scan) {
        compare();
        map.emplace(octree_of(scan));
        keys.clear();
        map->for_each_point([&](const occupancy::VoxelPoint& point) { keys.push_back(point.key); });
      },
      [&](const Scan&) { normals = field_normals(*map, keys, radius); });
  compare();
  state.counters["known_percent"] = 100 * known / points;
  state.counters["planar_points"] = static_cast<double>(angles.size());
  state.counters["mean_angle_deg"] =
      sum(angles) / static_cast<double>(std::max<std::size_t>(angles.size(), 1));
  state.counters["p95_angle_deg"] = percentile(angles, 0.95);
}

void mls_normals(benchmark::State& state, const Scans& scans, double radius) {
  pcl::Points points;
  for_each(
      state, scans, [&](const Scan& scan) { points = points_of(octree_of(scan)); },
      [&](const Scan&) { benchmark::DoNotOptimize(pcl::mls_normals(points, radius)); });
}

/// A large floor, slightly tilted, with round holes, that grows by patches along one edge.
class GrowingFloor {
 public:
  explicit GrowingFloor(std::size_t start) : side_(static_cast<int>(std::sqrt(static_cast<double>(start)))) {
    plane_.normal = Eigen::Vector3d(0.1, 0.2, 1).normalized();
    for (int x = 0; inliers_.size() < start; ++x)
      for (int y = -side_ / 2; y < side_ / 2 && inliers_.size() < start; ++y)
        if (!in_hole(x, y)) add(x, y);
    next_column_ = inliers_.back().key.x - geometry::VoxelGrid::origin + 1;
  }

  const Plane& plane() const { return plane_; }
  const std::vector<surfaces::Inlier>& inliers() const { return inliers_; }

  /// One more patch of 1,000 voxels beyond the edge, next to the patch before it.
  void grow() {
    constexpr int depth = 25, width = 1000 / depth;
    const int first = -side_ / 2 + patches_++ * width % std::max(width, side_ - width);
    for (int y = first; y < first + width; ++y)
      for (int x = next_column_; x < next_column_ + depth; ++x) add(x, y);
  }

  surfaces::SurfaceModel model() const {
    surfaces::SurfaceModel model(1, plane_, Eigen::Vector3d::Zero(), resolution);
    for (const surfaces::Inlier& inlier : inliers_) model.add(inlier);
    return model;
  }

 private:
  static bool in_hole(int x, int y) {
    const double pitch = 100, radius = 12;  // cells
    return std::hypot(std::remainder(x, pitch), std::remainder(y, pitch)) < radius;
  }
  /// The voxel of column (x, y) that the plane passes, with a point within 0.3 d and the noise.
  void add(int x, int y) {
    const double u = (x + 0.5 + random_.uniform(-0.3, 0.3)) * resolution;
    const double v = (y + 0.5 + random_.uniform(-0.3, 0.3)) * resolution;
    const double z = -(plane_.normal.x() * u + plane_.normal.y() * v) / plane_.normal.z();
    surfaces::Inlier inlier;
    inlier.range_class = 4;
    inlier.position = Eigen::Vector3d(u, v, z + random_.uniform(-0.2, 0.2) * resolution).cast<float>();
    if (grid_.key_of(inlier.position, inlier.key)) inliers_.push_back(inlier);
  }

  int side_;
  geometry::VoxelGrid grid_{resolution};
  Plane plane_;
  simulation::Random random_{1, 1};
  std::vector<surfaces::Inlier> inliers_;
  int next_column_ = 0, patches_ = 0;
};

/// The outline's digest, which depends neither on where a ring begins nor on which comes first; adds its
/// area and vertices to the counters.
std::uint64_t count_rings(benchmark::State& state, const surfaces::SurfaceModel& model) {
  std::uint64_t digest = 0;
  double area_m2 = 0, vertices = 0;
  const auto add = [&](const Ring2& ring) {
    area_m2 += reference::signed_area(ring);
    vertices += static_cast<double>(ring.size());
    std::vector<std::pair<std::int64_t, std::int64_t>> rounded;
    for (const Eigen::Vector2d& p : ring)
      rounded.emplace_back(std::llround(p.x() * 1e9), std::llround(p.y() * 1e9));
    std::rotate(rounded.begin(), std::min_element(rounded.begin(), rounded.end()), rounded.end());
    std::uint64_t hash = rounded.size();
    const geometry::PackedKeyHash mix;
    for (const auto& [u, v] : rounded)
      hash = mix(mix(hash ^ static_cast<std::uint64_t>(u)) ^ static_cast<std::uint64_t>(v));
    digest += hash;
  };
  for (const Polygon& polygon : model.polygons()) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  state.counters["area_m2"] = area_m2;
  state.counters["vertices"] = vertices;
  return digest;
}

constexpr double max_hole_size = 0.08;  // m, h

/// The surface lives on: the new inliers are added and the outline is brought up to date. Counter
/// `digest`: of the outlines after all steps.
void derive_grown(benchmark::State& state, std::size_t start) {
  GrowingFloor floor(start);
  surfaces::SurfaceModel model = floor.model();
  model.derive(max_hole_size);
  std::uint64_t digest = 0;
  for ([[maybe_unused]] auto _ : state) {
    state.PauseTiming();
    const std::size_t known = floor.inliers().size();
    floor.grow();
    state.ResumeTiming();
    for (std::size_t i = known; i < floor.inliers().size(); ++i) model.add(floor.inliers()[i]);
    model.derive(max_hole_size);
    state.PauseTiming();
    digest = digest * 31 + count_rings(state, model);
    state.ResumeTiming();
  }
  state.counters["digest"] = as_counter(digest);
}

/// The outline of a new surface with the same inliers; that they were added is not timed.
void derive_fresh(benchmark::State& state, std::size_t start) {
  GrowingFloor floor(start);
  std::optional<surfaces::SurfaceModel> model;
  std::uint64_t digest = 0;
  for ([[maybe_unused]] auto _ : state) {
    state.PauseTiming();
    floor.grow();
    model.emplace(floor.model());
    state.ResumeTiming();
    model->derive(max_hole_size);
    state.PauseTiming();
    digest = digest * 31 + count_rings(state, *model);
    state.ResumeTiming();
  }
  state.counters["digest"] = as_counter(digest);
}

/// The reference's alpha shape: CGAL's Delaunay triangulation of all inliers at once.
void derive_reference(benchmark::State& state, std::size_t start) {
  GrowingFloor floor(start);
  const Eigen::Matrix3d to_plane = geometry::plane_axes(floor.plane().normal).transpose();
  std::vector<Eigen::Vector2d> projected;
  reference::AlphaShape shape;
  for ([[maybe_unused]] auto _ : state) {
    state.PauseTiming();
    floor.grow();
    projected.clear();
    for (const surfaces::Inlier& inlier : floor.inliers())
      projected.emplace_back((to_plane * inlier.position.cast<double>()).head<2>());
    state.ResumeTiming();
    shape = reference::alpha_shape(projected, max_hole_size);
  }
  state.counters["area_m2"] = shape.area_m2;
}

}  // namespace

void add_surface_parts(bool brief) {
  const std::size_t scans = brief ? 3 : 10, steps = brief ? 3 : 10;
  for (const double radius : {0.05, 0.06, 0.15}) {
    const std::string path = "normals/" + key('r', radius);
    const auto on_kitchen = [=](auto body) {
      return [=](benchmark::State& state) { body(state, kitchen_scans(scans, 10), radius); };
    };
    add(path + "/normal_field", "normals of one kitchen frame, 2 cm, r = " + centimetres(radius), scans,
        on_kitchen(normal_field))
        ->UseRealTime();
    add(path + "/mls", "PCL's moving least squares", scans, on_kitchen(mls_normals))->UseRealTime();
  }
  for (const std::size_t inliers : {100'000, 1'000'000}) {
    const std::string path = "derive/" + std::to_string(inliers);
    const auto from = [=](auto body) { return [=](benchmark::State& state) { body(state, inliers); }; };
    add(path + "/grown",
        std::string("outline of a surface of ") + (inliers == 100'000 ? "100,000" : "1,000,000") +
            " inliers that grew by 1,000",
        steps, from(derive_grown))
        ->UseRealTime();
    add(path + "/fresh", "our own from scratch", steps, from(derive_fresh))->UseRealTime();
    add(path + "/reference", "CGAL's Delaunay from scratch", steps, from(derive_reference))->UseRealTime();
  }
}

}  // namespace octosurf::bench
