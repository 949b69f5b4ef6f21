#include "bench/bench.hpp"

#include "planning/contact_shape.hpp"
#include "planning/rings.hpp"
#include "simulation/scenes.hpp"

#include <chrono>
#include <cstdio>
#include <malloc.h>
#include <numeric>
#include <regex>
#include <unistd.h>

#include <octosurf/scan_source.hpp>

namespace octosurf::bench {
namespace {

/// The file of a mesh: what has an ending, or a name of the terrains. Empty: a scene.
std::filesystem::path mesh_of(const std::string& scene) {
  if (std::filesystem::path(scene).has_extension()) return scene;
  if (std::ranges::count(simulation::scene_names(), scene) > 0) return {};
  return data_path("terrain_meshes/" + scene + ".stl");
}

/// Every `every`-th scan of a recording, at most `limit` (0: all).
void for_each_scan(const std::filesystem::path& recording, std::size_t every, std::size_t limit,
                   const VisitScan& visit) {
  const auto source = open_scans({recording});
  for (std::size_t index = 0; limit == 0 || index <= (limit - 1) * every; ++index) {
    const std::optional<Scan> scan = source->next();
    if (!scan) return;
    if (index % every == 0) visit(*scan);
  }
}

}  // namespace

void write(Json row, const Json& more) {
  row.update(more);
  std::printf("%s\n", row.dump(-1, ' ', false, Json::error_handler_t::replace).c_str());
  std::fflush(stdout);
}

void for_each_recording(const Options& options,
                        const std::function<void(const Recorded&, const Json& row)>& visit) {
  for (const std::string& sensor : options.sensors)
    for (const std::string& scene : options.scenes)
      for (const std::uint64_t seed : options.seeds) {
        simulation::SimulationOptions simulation;
        simulation.scene = scene;
        simulation.mesh = mesh_of(scene);
        simulation.sensor = sensor;
        simulation.seed = seed;
        if (options.frames > 0)
          simulation.frames = options.frames;
        else if (!simulation.mesh.empty())
          simulation.frames = 300;  // a step of 10 to 15 cm each
        simulation.noise_scale = options.noise_scale;
        simulation.drift_m = options.drift_m;
        simulation.drift_rad = options.drift_deg / deg;
        simulation.laps = options.laps;
        Recorded recorded{std::make_shared<const simulation::Recording>(simulation), {}, {}, {}};
        simulation::Recording::Visibility visibility = recorded.simulated->visibility();
        for (std::size_t i = 0; i < recorded.simulated->size(); ++i) {
          const simulation::Readings ideal = recorded.simulated->ideal(i);
          visibility.add(i, ideal);
          auto labelled = recorded.simulated->labelled_scan(i, ideal);
          recorded.scans.push_back(std::move(labelled.scan));
          recorded.labels.push_back(std::move(labelled.labels));
        }
        recorded.truth = visibility.truth();
        visit(recorded,
              {{"sensor", sensor}, {"scene", std::filesystem::path(scene).stem().string()}, {"seed", seed}});
        std::fprintf(stderr, "%s %s %zu done\n", sensor.c_str(), scene.c_str(), std::size_t{seed});
      }
}

Parameters parameters_at(double resolution, const std::vector<std::string>& set) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  for (const std::string& assignment : set) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos)
      throw Error(Error::Kind::usage, "--set " + assignment, "has no value", "write --set NAME=VALUE");
    set_parameter(parameters, assignment.substr(0, equals), assignment.substr(equals + 1));
  }
  return parameters;
}

Parameters paper_parameters(double resolution, double search_radius) {
  Parameters parameters = Parameters::paper(resolution);
  parameters.detection.search_radius = search_radius;
  return parameters;
}

bool wanted(const Options& options, const std::string& name) {
  const auto begins = [&](const std::string& with) {
    return std::regex_search(name, std::regex("^(" + with + ")"));
  };
  return options.only.empty() || std::ranges::any_of(options.only, begins);
}

std::filesystem::path data_path(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(OCTOSURF_DATA_DIR) / name;
  if (!std::filesystem::exists(path))
    throw Error(Error::Kind::data, path.string(), "is missing", "name another with --inputs or --scenes");
  return path;
}

std::filesystem::path kitchen_of(const Options& options) {
  if (!options.inputs.empty()) return options.inputs.front();
  return data_path("rgbd_7scenes_redkitchen");
}

std::vector<Scan> scans_of(const std::filesystem::path& recording, std::size_t limit) {
  std::vector<Scan> scans;
  for_each_scan(recording, 1, limit, [&](const Scan& scan) { scans.push_back(scan); });
  return scans;
}

void for_each_kitchen_scan(const Options& options, const VisitScan& visit) {
  for_each_scan(kitchen_of(options), options.every, options.frames, visit);
}

void for_each_run(const Options& options, std::size_t every,
                  const std::function<void(Json, const std::function<void(const VisitScan&)>&)>& run) {
  run({{"scene", "kitchen"}}, [&](const VisitScan& visit) { for_each_kitchen_scan(options, visit); });
  for_each_recording(options, [&](const Recorded& recorded, const Json& row) {
    run(row, [&](const VisitScan& visit) {
      for (std::size_t i = 0; i < recorded.scans.size(); i += every) visit(recorded.scans[i]);
    });
  });
}

OctomapScan::OctomapScan(const Scan& scan) {
  const auto point = [](const Eigen::Vector3d& p) {
    const Eigen::Vector3f single = p.cast<float>();
    return octomap::point3d(single.x(), single.y(), single.z());
  };
  origin = point(scan.T_map_sensor.translation());
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& p : scan.points)
    if (p.allFinite()) cloud.push_back(point(scan.T_map_sensor * p.cast<double>()));
}

std::vector<Face> faces_of(const Snapshot& snapshot) {
  std::vector<Face> faces;
  for (const SurfacePtr& one : snapshot.surfaces)
    faces.push_back(
        {one->plane, one->T_map_surface, evaluation::PlanarRegion(one->polygons), one.get(), nullptr});
  return faces;
}

std::vector<Face> standing_faces(const evaluation::Truth& truth) {
  std::vector<Face> faces;
  for (const evaluation::TrueFace& one : truth.faces)
    if (!one.gone)
      faces.push_back({one.plane, one.T_map_face, evaluation::PlanarRegion(one.polygons), nullptr, &one});
  return faces;
}

double off_outlines(const std::vector<Face>& faces, const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                    double tolerance, double at_most) {
  for (const Face& face : faces) {
    if (face.normal().dot(normal) < std::cos(max_slope) || face.region.empty() ||
        std::abs(face.height(p)) > tolerance)
      continue;
    if (face.holds(p)) return 0;
    at_most = std::min(at_most, face.region.ring_distance(face.foot(p), at_most));
  }
  return at_most;
}

Ring2 ring_of(const ContactShape& shape) {
  return shape.outline.empty() ? planning::around_disc(shape.radius) : shape.outline;
}

std::vector<Eigen::Vector2d> points_of(const ContactShape& shape, double margin) {
  constexpr double step = 0.01;
  Ring2 ring = ring_of(shape);
  if (margin > 0) ring = planning::minkowski_sum(ring, planning::around_disc(margin));
  std::vector<Eigen::Vector2d> points = ring;
  evaluation::for_each_on_ring(ring, step, [&points](const Eigen::Vector2d& p) { points.push_back(p); });
  const double reach = shape.reach() + margin;
  for (double x = -reach; x < reach; x += step)
    for (double y = -reach; y < reach; y += step)
      if (planning::depth_in(ring, {x, y}) > 0) points.emplace_back(x, y);
  return points;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

Json quantiles(const std::string& prefix, const std::string& unit, const std::vector<double>& values) {
  return {{prefix + "p50_" + unit, percentile(values, 0.5)},
          {prefix + "p99_" + unit, percentile(values, 0.99)}};
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

double time_ms(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

Json stages_of(const std::vector<ScanReport>& reports, double (*statistic)(const std::vector<double>&)) {
  Json stages;
  for (std::size_t stage = 0; stage < stage_names.size(); ++stage) {
    std::vector<double> ms;
    for (const ScanReport& report : reports) ms.push_back(report.stage_ms[stage]);
    stages[std::string(stage_names[stage])] = statistic(ms);
  }
  return stages;
}

double heap_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

std::string scratch(const std::string& name) {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("octosurf-bench-" + std::to_string(getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  return (folder.path / name).string();
}

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Options, scenes, sensors, seeds, resolutions, only, set,
                                                inputs, count, frames, every, octomap_every, noise_scale,
                                                drift_m, drift_deg, laps, threads, mosd, brief)

}  // namespace octosurf::bench

/// octosurf_bench NAME OPTIONS. What goes wrong is one line on stderr and exit code 1.
int main(int argc, char** argv) {
  using namespace octosurf::bench;
  // clang-format off
  const std::map<std::string, Benchmark*> benchmarks{
      {"accuracy", accuracy}, {"departures", departures}, {"footholds", footholds}, {"ground", ground},
      {"kitchen", kitchen}, {"labelled", labelled}, {"life", life}, {"repeatability", repeatability},
      {"speed", speed}, {"steadiness", steadiness}, {"table1", table1}};
  // clang-format on
  try {
    benchmarks.at(argc == 3 ? argv[1] : "")(nlohmann::json::parse(argv[2]).get<Options>());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
