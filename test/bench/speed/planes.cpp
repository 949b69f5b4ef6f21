// Planes of one scan, and of many, beside CGAL's region growing and Efficient RANSAC on the same voxels.

#include "bench/cgal_planes.hpp"
#include "bench/speed/speed.hpp"
#include "bench/support.hpp"
#include "evaluation/evaluate.hpp"
#include "reference/alpha_shape.hpp"
#include "sensing/downsample.hpp"
#include "simulation/recording.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>
#include <tsl/robin_set.h>

namespace octosurf::bench {
namespace {

constexpr double resolution = 0.02;  // m

/// Scans spread evenly over a recording, and for a simulated one what is true of each and of all.
struct PlaneScene {
  Scans scans;
  std::vector<evaluation::Truth> truths;
  std::optional<evaluation::Truth> truth;
};

PlaneScene simulated(const std::string& name, std::size_t count) {
  simulation::SimulationOptions options;
  options.scene = name;
  const simulation::Recording recording(options);
  simulation::Recording::Visibility all = recording.visibility();
  PlaneScene scene;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = k * recording.size() / count;
    const simulation::Readings ideal = recording.ideal(i);
    simulation::Recording::Visibility one = recording.visibility();
    one.add(i, ideal);
    all.add(i, ideal);
    scene.truths.push_back(one.truth());
    scene.scans.push_back(recording.labelled_scan(i, ideal).scan);
  }
  scene.truth = all.truth();
  return scene;
}

const PlaneScene& scene_of(const std::string& name, std::size_t count) {
  static std::map<std::string, PlaneScene> scenes;
  PlaneScene& scene = scenes[name];
  if (scene.scans.empty())
    scene = name == "kitchen" ? PlaneScene{kitchen_scans(count, 10), {}, {}} : simulated(name, count);
  return scene;
}

/// Adds to the counters how good a map's surfaces are.
void score(benchmark::State& state, const Snapshot& snapshot, const evaluation::Truth* truth) {
  state.counters["surfaces"].value += static_cast<double>(snapshot.surfaces.size());
  if (truth == nullptr) return;
  const evaluation::Evaluation found = evaluation::evaluate(snapshot, *truth);
  state.counters["faces"].value += static_cast<double>(found.faces);
  state.counters["correct"].value += static_cast<double>(found.correct);
  state.counters["noise"].value += static_cast<double>(found.noise);
  state.counters["area_m2"].value += found.area_m2;
  state.counters["unsafe_m2"].value += found.unsafe_m2;
}

void score_scan(benchmark::State& state, const Snapshot& snapshot, const PlaneScene& scene, std::size_t i) {
  score(state, snapshot, scene.truths.empty() ? nullptr : &scene.truths.at(i));
}

void score_all(benchmark::State& state, const Snapshot& snapshot, const PlaneScene& scene) {
  score(state, snapshot, scene.truth ? &*scene.truth : nullptr);
}

/// The stages from retract on: CGAL neither groups points by voxel nor keeps an octree.
double planes_s(const ScanReport& report) {
  double ms = 0;
  for (std::size_t stage = static_cast<std::size_t>(Stage::retract); stage < stage_names.size(); ++stage)
    ms += report.stage_ms[stage];
  return ms / 1000;
}

void mapper_frames(benchmark::State& state, const PlaneScene& scene) {
  std::size_t i = 0;
  double insert_ms = 0;
  for ([[maybe_unused]] auto _ : state) {
    Mapper mapper(parameters_at(resolution), 1);
    const ScanReport report = mapper.insert(scene.scans.at(i));
    state.SetIterationTime(planes_s(report));
    insert_ms += report.total_ms;
    score_scan(state, *mapper.snapshot(), scene, i++);
  }
  state.counters["insert_ms"] = benchmark::Counter(insert_ms, benchmark::Counter::kAvgIterations);
}

/// What a scan costs once the map holds half of them: the other half is timed.
void mapper_accumulated(benchmark::State& state, const PlaneScene& scene) {
  Mapper mapper(parameters_at(resolution), 1);
  std::size_t i = 0;
  double all_ms = 0;
  const auto insert = [&] {
    const ScanReport report = mapper.insert(scene.scans.at(i++));
    all_ms += report.total_ms;
    return planes_s(report);
  };
  while (i < scene.scans.size() / 2) insert();
  for ([[maybe_unused]] auto _ : state) state.SetIterationTime(insert());
  state.counters["insert_all_ms"] = all_ms;
  score_all(state, *mapper.snapshot(), scene);
}

/// CGAL's input, the centroid per voxel that octosurf starts from, too; and its regions as surfaces.
class CgalInput {
 public:
  void add(const Scan& scan) {
    const sensing::VoxelScan voxels = downsampler_(scan, 0, camera_range);
    for (const sensing::EndVoxel& end : voxels.ends) {
      if ((end.centroid - voxels.origin).norm() > camera_range || !seen_.insert(end.key.packed()).second)
        continue;
      points_.push_back(end.centroid);
      views_.emplace_back((voxels.origin - end.centroid).normalized());
    }
  }

  /// s, h, n and the angle are octosurf's defaults.
  template <class Method>
  CgalPlanes planes(const Method& method) const {
    CgalSettings settings;
    settings.tolerance = parameters_.surface_tolerance();
    settings.angle_rad = parameters_.detection.smoothness_angle;
    settings.gap = parameters_.max_hole_size();
    settings.min_points = static_cast<std::size_t>(parameters_.min_surface_points());
    return method(points_, settings);
  }

  Snapshot snapshot(const CgalPlanes& planes) const {
    Snapshot snapshot;
    snapshot.resolution = resolution;
    for (const auto& region : planes.regions)
      snapshot.surfaces.push_back(surface_of(region, static_cast<SurfaceId>(snapshot.surfaces.size() + 1)));
    return snapshot;
  }

 private:
  /// Least-squares plane of the region, toward where it was seen from; outline: the reference's.
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

  Parameters parameters_ = parameters_at(resolution);
  sensing::Downsampler downsampler_{geometry::VoxelGrid(resolution)};
  std::vector<Eigen::Vector3f> points_, views_;
  tsl::robin_set<std::uint64_t, geometry::PackedKeyHash> seen_;
};

using CgalMethod = CgalPlanes (*)(const std::vector<Eigen::Vector3f>&, const CgalSettings&);

CgalPlanes timed_planes(benchmark::State& state, const CgalInput& input, CgalMethod method) {
  CgalPlanes planes = input.planes(method);
  state.SetIterationTime((planes.normals_ms + planes.planes_ms) / 1000);
  return planes;
}

void cgal_frames(benchmark::State& state, const PlaneScene& scene, CgalMethod method) {
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    CgalInput input;
    input.add(scene.scans.at(i));
    score_scan(state, input.snapshot(timed_planes(state, input, method)), scene, i);
    ++i;
  }
}

void cgal_accumulated(benchmark::State& state, const PlaneScene& scene, CgalMethod method) {
  CgalInput input;
  for (const Scan& scan : scene.scans) input.add(scan);
  for ([[maybe_unused]] auto _ : state)
    score_all(state, input.snapshot(timed_planes(state, input, method)), scene);
}

}  // namespace

void add_planes(bool brief) {
  const std::size_t count = brief ? 4 : 20;
  for (const std::string name : {"room", "office", "stairs", "kitchen"}) {
    const std::string frame = "planes/frame/" + name + "/", many = "planes/accumulated/" + name + "/";
    const auto on_scene = [name, count](auto body, auto... method) {
      return [=](benchmark::State& state) { body(state, scene_of(name, count), method...); };
    };
    // The scans are the spread, so once is enough.
    add(frame + "mapper", "planes of one frame, " + name + ", 2 cm", count, on_scene(mapper_frames))
        ->UseManualTime()
        ->Repetitions(1);
    add(many + "mapper",
        "planes of " + std::to_string(count) + " scans, up to date after one more, " + name + ", 2 cm",
        count / 2, on_scene(mapper_accumulated))
        ->UseManualTime()
        ->Repetitions(1);
    for (const auto& [side, label, method] :
         {std::tuple<const char*, const char*, CgalMethod>{"region_growing", "CGAL Region_growing",
                                                           cgal_region_growing},
          {"ransac", "CGAL Efficient_RANSAC", cgal_efficient_ransac}}) {
      add(frame + side, label, count, on_scene(cgal_frames, method))->UseManualTime()->Repetitions(1);
      add(many + side, label, 1, on_scene(cgal_accumulated, method))->UseManualTime()->Repetitions(1);
    }
  }
}

}  // namespace octosurf::bench
