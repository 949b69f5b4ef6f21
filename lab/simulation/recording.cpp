#include "simulation/recording.hpp"

#include "simulation/faces.hpp"
#include "simulation/mesh_walk.hpp"
#include "simulation/outside.hpp"
#include "simulation/ray_caster.hpp"
#include "simulation/real_camera.hpp"
#include "simulation/sensor.hpp"
#include "simulation/trajectory.hpp"
#include "simulation/visible_cells.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <octosurf/error.hpp>

namespace octosurf::simulation {

namespace {

/// Streams of random numbers drawn from one seed; scan i's noise is stream first_noise + i, its drop-outs
/// are stream first_drop_out + i. A recording has a million scans at most.
enum Stream : std::uint64_t {
  dimensions = 1,
  placement = 2,
  drift = 3,
  bias = 4,
  albedo = 5,
  first_noise = 1000,
  first_drop_out = 2'000'000
};

constexpr double walking_step = 0.05;  ///< m between scans over a mesh

/// Turns, shifts and scales the world, so that no plane of it is aligned with the octree.
Similarity place_world(Random random) {
  constexpr double max_tilt_rad = 3 * std::numbers::pi / 180;
  Similarity T;
  const double toward_rad = random.uniform(0, 2 * std::numbers::pi);
  const Eigen::AngleAxisd tilt(random.uniform(0.2, 1) * max_tilt_rad,
                               Eigen::Vector3d(std::cos(toward_rad), std::sin(toward_rad), 0));
  const Eigen::AngleAxisd yaw(random.uniform(0, 2 * std::numbers::pi), Eigen::Vector3d::UnitZ());
  T.R = (tilt * yaw).toRotationMatrix();
  T.t = {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-1, 1)};
  T.scale = random.uniform(0.9, 1.1);
  return T;
}

/// Scans of the depth camera that show the scene well in one lap.
double default_depth_frames(const SimulationOptions& options, const Scene& scene) {
  if (!options.mesh.empty()) return path_length_m(scene.path) / walking_step;
  if (scene.of_stairs) return std::max(80.0, path_length_m(scene.path) / (3 * walking_step));
  if (options.scene == "corridor") return 12 * options.length;
  if (options.scene == "storeys") return 240;
  return options.scene == "change" ? 120 : 80;
}

std::size_t frame_count(const SimulationOptions& options, const SensorModel& sensor, const Scene& scene) {
  if (options.frames) return *options.frames;
  double factor = sensor.frame_factor;
  // The corridor is walked at a pace that a lidar, which sees all around, can do with fewer scans.
  if (options.scene == "corridor") factor = std::min(factor, 3.0);
  // A laser that takes 5 s from top to bottom sees each tread while it is near.
  if (scene.of_stairs && sensor.name == "tilting") factor *= 2;
  return static_cast<std::size_t>(std::ceil(default_depth_frames(options, scene) * factor * options.laps));
}

/// A scene and its true faces.
struct Place {
  Scene scene;
  Similarity T_map_scene;
  Faces faces;
  std::optional<MeshSummary> mesh;
};

Place make_place(const SimulationOptions& options) {
  Similarity T = place_world(Random(options.seed, Stream::placement));
  const Random dimensions(options.seed, Stream::dimensions);
  if (options.mesh.empty()) {
    Scene scene = make_scene(options.scene, dimensions, options.length);
    if (scene.of_stairs) T.scale = 1;
    Faces faces(scene, T);
    return {std::move(scene), T, std::move(faces), std::nullopt};
  }
  T.scale = 1;  // a file's steps are as high as it says
  const TriangleMesh mesh = read_mesh(options.mesh, {options.mesh_up, options.mesh_scale});
  Scene scene = scene_of(mesh, options.mesh.stem().string());
  scene.path = walk_over(mesh, dimensions);
  return {std::move(scene), T, Faces(find_mesh_faces(mesh), T),
          MeshSummary{mesh.triangles.size(), mesh.dropped, mesh.open_edges}};
}

/// One normal a facet, of either sign, counted as RayCaster counts them; map frame.
std::vector<Eigen::Vector3d> facet_normals(const Scene& scene, const Similarity& T_map_scene) {
  std::vector<Eigen::Vector3d> normals;
  for (const auto& solid : scene.solids)
    for (const auto& facet : solid.facets) {
      Eigen::Vector3d twice_area = Eigen::Vector3d::Zero();
      for (std::size_t i = 2; i < facet.ring.size(); ++i)
        twice_area += (facet.ring[i - 1] - facet.ring[0]).cross(facet.ring[i] - facet.ring[0]);
      normals.emplace_back((T_map_scene.R * twice_area).normalized());
    }
  return normals;
}

}  // namespace

struct Recording::Impl {
  explicit Impl(const SimulationOptions& o)
      : options((o.validate(), o)), sensor(make_sensor(o.sensor)), place(make_place(o)) {
    path = walk_path(scene.path, frame_count(options, sensor, scene), options.laps);
    casters.emplace_back(scene, T_map_scene, 0);
    if (scene.changes()) casters.emplace_back(scene, T_map_scene, 1);
    Random random(options.seed, Stream::drift);
    const double toward_rad = random.uniform(0, 2 * std::numbers::pi);
    drift_toward = T_map_scene.R * Eigen::Vector3d(std::cos(toward_rad), std::sin(toward_rad), 0);
    if (sensor.name == "depth-real") {
      real_camera.emplace(Random(o.seed, Stream::bias), Random(o.seed, Stream::albedo), o.noise_scale);
      normals = facet_normals(scene, T_map_scene);
    }
  }

  double albedo(std::uint16_t label, const Eigen::Vector3d& point) const {
    if (label == 0) return real_camera->albedo(0, Eigen::Vector2d::Zero());
    return real_camera->albedo(label, (faces.all()[label - 1].T_map_face.inverse() * point).head<2>());
  }

  /// What only a real camera asks of the hits that `readings` were made of.
  void drop_out(std::size_t i, const Eigen::Isometry3d& T, const std::vector<Eigen::Vector3f>& directions,
                const std::vector<Hit>& hits, Readings& readings) const {
    std::vector<double> albedos(hits.size());
    readings.incidence_rad.resize(hits.size());
    for (std::size_t k = 0; k < hits.size(); ++k) {
      if (readings.t[k] == 0) continue;
      const Eigen::Vector3d direction = directions[k].cast<double>();
      const double facing = std::abs(normals[hits[k].facet].dot(direction)) / direction.norm();
      readings.incidence_rad[k] = static_cast<float>(std::acos(std::min(facing, 1.0)));
      albedos[k] = albedo(readings.labels[k], T.translation() + double{hits[k].t} * direction);
    }
    real_camera->drop(albedos, Random(options.seed, Stream::first_drop_out + i), readings);
  }

  /// The scene changes after the first half of the scans.
  const RayCaster& caster(std::size_t i) const {
    return casters[casters.size() > 1 && i >= path.size() / 2 ? 1 : 0];
  }

  Eigen::Isometry3d pose(std::size_t i) const {
    const Eigen::Isometry3d T_scene_sensor = sensor.mount(path.at(i), i);
    Eigen::Isometry3d T;
    T.linear() = T_map_scene.R * T_scene_sensor.linear();
    T.translation() = T_map_scene * T_scene_sensor.translation();
    T.makeAffine();
    return T;
  }

  SimulationOptions options;
  SensorModel sensor;
  Place place;
  const Scene& scene = place.scene;
  const Similarity& T_map_scene = place.T_map_scene;
  const Faces& faces = place.faces;
  std::vector<RayCaster> casters;
  std::vector<HeadPose> path;
  Eigen::Vector3d drift_toward;
  std::optional<RealCamera> real_camera;  ///< of depth-real
  std::vector<Eigen::Vector3d> normals;   ///< of facets; for the real camera alone
};

Recording::Recording(const SimulationOptions& options) : impl_(std::make_shared<const Impl>(options)) {}

std::size_t Recording::size() const { return impl_->path.size(); }
const std::vector<Eigen::Vector3f>& Recording::rays() const { return impl_->sensor.rays; }
std::optional<MeshSummary> Recording::mesh() const { return impl_->place.mesh; }
const std::vector<evaluation::TrueFace>& Recording::faces() const& { return impl_->faces.all(); }

double Recording::stamp_s(std::size_t i) const { return static_cast<double>(i) / impl_->sensor.scans_per_s; }

Eigen::Isometry3d Recording::true_pose(std::size_t i) const { return impl_->pose(i); }

Eigen::Isometry3d Recording::T_map_sensor(std::size_t i) const {
  const auto& options = impl_->options;
  const Eigen::Isometry3d T = impl_->pose(i);
  if (options.drift_m == 0 && options.drift_rad == 0) return T;
  // Dead reckoning: the error grows evenly with the way, about the place where the walk began.
  const double laps =
      options.laps * static_cast<double>(i) / static_cast<double>(std::max<std::size_t>(size() - 1, 1));
  const Eigen::Vector3d start = impl_->pose(0).translation();
  const Eigen::AngleAxisd turn(laps * options.drift_rad, impl_->T_map_scene.R.col(2));
  return Eigen::Translation3d(start + laps * options.drift_m * impl_->drift_toward) * turn *
         Eigen::Translation3d(-start) * T;
}

Readings Recording::ideal(std::size_t i) const {
  const auto& sensor = impl_->sensor;
  const Eigen::Isometry3d T = impl_->pose(i);
  const Eigen::Matrix3f R = T.linear().cast<float>();
  std::vector<Eigen::Vector3f> directions;
  directions.reserve(sensor.rays.size());
  for (const auto& ray : sensor.rays) directions.emplace_back(R * ray);
  const auto hits = impl_->caster(i).cast(T.translation(), directions, sensor.max_t);
  Readings readings;
  readings.t.resize(hits.size());
  readings.labels.resize(hits.size());
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (hits[k].t < sensor.min_t) continue;
    readings.t[k] = hits[k].t;
    const Eigen::Vector3d direction = directions[k].cast<double>();
    readings.labels[k] = impl_->faces.label(
        hits[k].facet, T.translation() + static_cast<double>(hits[k].t) * direction, direction);
  }
  if (impl_->real_camera) impl_->drop_out(i, T, directions, hits, readings);
  return readings;
}

Readings Recording::measured(std::size_t i, const Readings& ideal) const {
  const auto& sensor = impl_->sensor;
  Random random(impl_->options.seed, Stream::first_noise + i);
  if (impl_->real_camera) {
    Readings real = impl_->real_camera->measured(ideal, random);
    for (std::size_t k = 0; k < real.t.size(); ++k) {
      real.t[k] = static_cast<float>(sensor.rounded(real.t[k]));
      if (real.t[k] == 0) real.labels[k] = 0;
    }
    return real;
  }
  Readings noisy;
  noisy.t.resize(ideal.t.size());
  noisy.labels.resize(ideal.t.size());
  for (std::size_t k = 0; k < ideal.t.size(); ++k) {
    const double t = ideal.t[k];
    if (t == 0) continue;
    const double error = impl_->options.noise_scale * sensor.sigma(t) * random.normal();
    noisy.t[k] = static_cast<float>(sensor.rounded(t + error));
    if (noisy.t[k] > 0) noisy.labels[k] = ideal.labels[k];
  }
  return noisy;
}

LabelledScan Recording::labelled_scan(std::size_t i, const Readings& ideal) const {
  const Readings readings = measured(i, ideal);
  LabelledScan labelled;
  labelled.scan.T_map_sensor = T_map_sensor(i);
  labelled.scan.stamp_s = stamp_s(i);
  labelled.scan.sensor = impl_->sensor.kind;
  labelled.scan.name = impl_->scene.name + " " + std::to_string(i);
  for (std::size_t k = 0; k < readings.t.size(); ++k) {
    if (readings.t[k] == 0) continue;
    labelled.scan.points.emplace_back(readings.t[k] * impl_->sensor.rays[k]);
    labelled.labels.push_back(readings.labels[k]);
  }
  return labelled;
}

Recording::Visibility Recording::visibility() const { return Visibility(*this); }

evaluation::Truth Recording::truth() const {
  Visibility visible(*this);
  for (std::size_t i = 0; i < size(); ++i) visible.add(i, ideal(i));
  return visible.truth();
}

struct Recording::Visibility::Impl {
  const Recording& recording;
  VisibleCells cells;
};

Recording::Visibility::Visibility(const Recording& recording)
    : impl_(new Impl{recording, VisibleCells(recording.faces(), recording.impl_->sensor)}) {}

void Recording::Visibility::add(std::size_t i, const Readings& ideal) {
  impl_->cells.add(impl_->recording.true_pose(i), ideal.t, ideal.labels);
}

evaluation::Truth Recording::Visibility::truth() const {
  const auto& recording = *impl_->recording.impl_;
  evaluation::Truth truth;
  truth.scene = recording.scene.name;
  truth.sensor = recording.options.sensor;
  truth.seed = recording.options.seed;
  truth.cell = recording.sensor.cell;
  truth.faces = impl_->cells.faces();
  for (evaluation::TrueStair stair : recording.scene.stairs) {
    stair.riser_m *= recording.T_map_scene.scale;
    stair.tread_m *= recording.T_map_scene.scale;
    for (auto& edge : stair.edges)
      for (Eigen::Vector3d& end : edge) end = recording.T_map_scene * end;
    truth.stairs.push_back(std::move(stair));
  }
  return truth;
}

}  // namespace octosurf::simulation
