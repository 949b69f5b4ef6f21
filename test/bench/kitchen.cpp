// The kitchen, a real recording without truth: what a map of it looks like, told by what must not be in it.

#include "bench/support.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <octomap/OcTree.h>

#include <octosurf/diagnosis.hpp>
#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/up.hpp>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;

struct Options {
  std::string input;
  double resolution = 0.02;
  std::size_t frames = 0, every = 1;
  int threads = 1;
  bool share_octree = false;
  double min_area = 0.05;
  std::size_t octomap_every = 0;
  std::vector<std::string> set;
  std::string json;
};

/// Up in the recording's frame: what gravity-direction.txt tells, else z.
Eigen::Vector3d true_up(const std::filesystem::path& recording) {
  Eigen::Vector3d down(0, 0, -1);
  std::ifstream file(recording / "gravity-direction.txt");
  for (int axis = 0; axis < 3 && file; ++axis) file >> down[axis];
  return -down.normalized();
}

Snapshot turned(const Snapshot& snapshot, const Eigen::Isometry3d& T) {
  Snapshot result = snapshot;
  for (SurfacePtr& surface : result.surfaces) {
    auto copy = std::make_shared<Surface>(*surface);
    copy->T_map_surface = T * surface->T_map_surface;
    copy->plane.normal = T.linear() * surface->plane.normal;
    copy->plane.offset = surface->plane.offset + copy->plane.normal.dot(T.translation());
    for (Eigen::Vector3d& point : copy->boundary) point = T * point;
    surface = copy;
  }
  return result;
}

struct Mapped {
  Snapshot snapshot;  ///< z up
  std::size_t scans = 0;
  double ms = 0;  ///< all scans
  std::array<double, stage_names.size()> stage_ms{};
  std::vector<double> octomap_ms;  ///< OctoMap's insertion of every octomap_every-th scan
  Up up;                           ///< as `--up auto` finds it, in the recording's frame
  double up_error_rad = 0;
};

/// OctoMap's own insertion of what a sensor that knows its pose would hand it.
double insertion_ms(octomap::OcTree& tree, const Scan& scan) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.points.size());
  for (const Eigen::Vector3f& point : scan.points) {
    const Eigen::Vector3f in_map = (scan.T_map_sensor * point.cast<double>()).cast<float>();
    if (in_map.allFinite()) cloud.push_back(in_map.x(), in_map.y(), in_map.z());
  }
  const Eigen::Vector3f origin = scan.T_map_sensor.translation().cast<float>();
  return time_ms([&] { tree.insertPointCloud(cloud, octomap::point3d(origin.x(), origin.y(), origin.z())); });
}

Mapped map_all(const Options& options, const std::filesystem::path& recording) {
  Parameters parameters;
  parameters.occupancy.resolution = options.resolution;
  set_parameters(parameters, options.set);
  const Eigen::Vector3d up = true_up(recording);
  const Eigen::Isometry3d T(upright(up));
  Mapper mapper(parameters, options.threads);
  if (options.share_octree) mapper.share_octree();
  octomap::OcTree octomap(options.resolution);
  Mapped mapped;
  for_each_scan(recording, options.every, options.frames, [&](const Scan& scan, double) {
    ScanReport report;
    mapped.ms += time_ms([&] { report = mapper.insert(scan); });
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
      mapped.stage_ms[stage] += report.stage_ms[stage];
    if (options.octomap_every != 0 && mapped.scans % options.octomap_every == 0)
      mapped.octomap_ms.push_back(insertion_ms(octomap, scan));
    ++mapped.scans;
  });
  mapper.drain();
  mapped.snapshot = turned(*mapper.snapshot(), T);
  mapped.up = up_from_surfaces(mapper.map());
  mapped.up_error_rad = std::atan2(mapped.up.direction.cross(up).norm(), mapped.up.direction.dot(up));
  return mapped;
}

/// Height of the middle of its boundary.
double height_of(const Surface& surface) {
  double sum = 0;
  for (const Eigen::Vector3d& p : surface.boundary) sum += p.z();
  return sum / static_cast<double>(std::max<std::size_t>(surface.boundary.size(), 1));
}

double tilt_of(const Surface& surface) { return std::acos(std::clamp(surface.plane.normal.z(), -1.0, 1.0)); }

/// Surfaces of `min_area` that face up, highest first.
std::vector<SurfacePtr> level_surfaces(const Snapshot& snapshot, double min_area) {
  constexpr double level_rad = 10 / deg;
  std::vector<SurfacePtr> level;
  for (const SurfacePtr& surface : snapshot.surfaces)
    if (surface->area_m2 >= min_area && tilt_of(*surface) <= level_rad) level.push_back(surface);
  std::sort(level.begin(), level.end(),
            [](const SurfacePtr& a, const SurfacePtr& b) { return height_of(*a) > height_of(*b); });
  return level;
}

/// The largest of those whose height is in [low, high]; nothing if there is none.
SurfacePtr largest_between(const std::vector<SurfacePtr>& level, double low, double high) {
  SurfacePtr largest;
  for (const SurfacePtr& surface : level) {
    const double height = height_of(*surface);
    if (height >= low && height <= high && (!largest || surface->area_m2 > largest->area_m2))
      largest = surface;
  }
  return largest;
}

void print_levels(const std::vector<SurfacePtr>& level, nlohmann::json& json) {
  if (level.empty()) return;
  constexpr double one_floor = 0.1, lowest_table = 0.5;  // m, above what lies lowest
  const double lowest = height_of(*level.back());
  const SurfacePtr floor = largest_between(level, lowest, lowest + one_floor);
  const SurfacePtr table = largest_between(level, lowest + lowest_table, HUGE_VAL);
  TextTable text({"faces up", "id", "height m", "area m²", "inliers", "rms mm", "tilt °"});
  for (const SurfacePtr& surface : level) {
    const std::string name = surface == floor ? "floor" : surface == table ? "table" : "";
    text.add({name, std::to_string(surface->id), fixed(height_of(*surface), 3), fixed(surface->area_m2, 3),
              std::to_string(surface->inliers), fixed(surface->rms_m * 1e3, 2),
              fixed(tilt_of(*surface) * deg, 2)});
    if (name.empty()) continue;
    json[name] = {
        {"area_m2", surface->area_m2}, {"rms_m", surface->rms_m}, {"tilt_deg", tilt_of(*surface) * deg}};
  }
  std::printf("%s", text.text().c_str());
}

void print_double_layers(const Snapshot& snapshot, nlohmann::json& json) {
  const std::vector<DoubleLayer> layers = double_layers(snapshot);
  json["double_layers"] = layers.size();
  json["double_layers_m2"] = 0.0;
  for (const DoubleLayer& layer : layers)
    json["double_layers_m2"] = json["double_layers_m2"].get<double>() + layer.overlap_m2;
  std::printf("double layers: %zu\n", layers.size());
  if (layers.empty()) return;
  TextTable table({"surfaces", "areas m²", "overlap m²", "apart mm", "angle °"});
  for (const DoubleLayer& layer : layers)
    table.add({std::to_string(layer.first) + ", " + std::to_string(layer.second),
               fixed(snapshot.find(layer.first)->area_m2, 3) + ", " +
                   fixed(snapshot.find(layer.second)->area_m2, 3),
               fixed(layer.overlap_m2, 3), fixed(layer.distance_m * 1e3, 1),
               fixed(layer.angle_rad * deg, 1)});
  std::printf("%s", table.text().c_str());
}

void body(const Options& options) {
  const std::filesystem::path recording =
      options.input.empty() ? kitchen() : std::filesystem::path(options.input);
  const Mapped mapped = map_all(options, recording);
  const auto over = static_cast<std::size_t>(
      std::count_if(mapped.snapshot.surfaces.begin(), mapped.snapshot.surfaces.end(),
                    [&](const SurfacePtr& surface) { return surface->area_m2 >= options.min_area; }));
  double area = 0;
  for (const SurfacePtr& surface : mapped.snapshot.surfaces) area += surface->area_m2;
  const auto scans = static_cast<double>(std::max<std::size_t>(mapped.scans, 1));
  std::printf("%zu scans, d = %g m, %.1f ms a scan:", mapped.scans, options.resolution, mapped.ms / scans);
  for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
    std::printf(" %s %.1f", stage_names[stage].data(), mapped.stage_ms[stage] / scans);
  std::printf("\n");
  std::printf("surfaces: %zu, of them %zu of %g m² and more; %.2f m²\n", mapped.snapshot.surfaces.size(),
              over, options.min_area, area);
  nlohmann::json json{{"scans", mapped.scans},
                      {"resolution", options.resolution},
                      {"surfaces", mapped.snapshot.surfaces.size()},
                      {"surfaces_over_min_area", over},
                      {"min_area_m2", options.min_area},
                      {"area_m2", area},
                      {"ms", mapped.ms / scans}};
  for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
    json["stage_ms"][stage_names[stage]] = mapped.stage_ms[stage] / scans;
  if (!mapped.octomap_ms.empty()) {
    const double octomap_ms = sum(mapped.octomap_ms) / static_cast<double>(mapped.octomap_ms.size());
    json["octomap_ms"] = octomap_ms;
    std::printf("OctoMap's insertion of %zu of them: %.1f ms a scan, %.1f times as long\n",
                mapped.octomap_ms.size(), octomap_ms, octomap_ms / (mapped.ms / scans));
  }
  json["up_error_deg"] = mapped.up_error_rad * deg;
  std::printf(
      "up, found from %.2f m² of level surfaces: %.2f° off; the next-best direction scores %.2f of it\n",
      mapped.up.level_m2, mapped.up_error_rad * deg, mapped.up.rival);
  print_double_layers(mapped.snapshot, json);
  print_levels(level_surfaces(mapped.snapshot, options.min_area), json);
  if (!options.json.empty()) write_json_file(options.json, json.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"surfaces, double layers, floor and table of the kitchen's map"};
  app.add_option("--input", options.input, "recording [the kitchen in ../shared/data]");
  app.add_option("--resolution", options.resolution, "d, m")->capture_default_str();
  app.add_option("--frames", options.frames, "scans at most; 0: all");
  app.add_option("--every", options.every, "every k-th scan only")->check(CLI::PositiveNumber);
  app.add_option("--threads", options.threads, "of Mapper")->check(CLI::PositiveNumber);
  app.add_flag("--share-octree", options.share_octree, "snapshots have the octree");
  app.add_option("--octomap-every", options.octomap_every,
                 "OctoMap inserts every k-th of the scans, in turn with ours; 0: none");
  app.add_option("--min-area", options.min_area, "m²: surfaces that are counted")->capture_default_str();
  app.add_option("--set", options.set, "NAME=VALUE; may be repeated");
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
