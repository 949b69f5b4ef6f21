#include "node_options.hpp"

#include "bounds.hpp"
#include "reading_options.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::node {

void add_options(CLI::App& app, NodeOptions& options) {
  auto* cloud = app.add_option("--cloud", options.cloud, "topic of sensor_msgs/PointCloud2");
  auto* depth =
      app.add_option("--depth", options.depth, "topic of depth as sensor_msgs/Image")->excludes(cloud);
  app.add_option("--camera-info", options.info, "topic; default: camera_info beside --depth")->needs(depth);
  app.add_option("--depth-scale", options.depth_scale,
                 "depth's units per metre [1000 of integers, 1 of floats]")
      ->check(CLI::PositiveNumber);
  app.option_defaults()->always_capture_default();
  app.add_option("--frame", options.frame, "the map's, in tf");
  app.add_option("--tf", options.tf, "topic of transforms; of fixed ones the same with _static");
  app.add_option("--base", options.base, "the robot's frame in tf, about which patches are read");
  app.add_option("--wait", options.wait_s, "longest time that a scan waits for tf and CameraInfo, s")
      ->check(CLI::Range(0.0, 60.0));
  app.add_flag("--reliable", options.reliable,
               "reliable QoS: lost scans are sent again; needs publishers that offer it");
  app.add_option("--queue", options.queue_mb, "MB of waiting scans; beyond it the oldest are dropped")
      ->check(CLI::Range(1, 65536));
  app.add_option("-o,--output", options.output, "the map: MAP.surfaces and MAP.bt")->required();
  auto* resume = app.add_flag("--resume", options.resume, "resume the map, if it is there");
  app.add_flag("--force", options.force, "start a new map, and overwrite an existing one")->excludes(resume);
  app.add_option("--checkpoint", options.checkpoint_s, "seconds between saves; 0: only at the end")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--name", options.name, "before topics and services");
  app.add_option("--publish", options.publish_s, "seconds between publications of the map")
      ->check(CLI::Range(0.01, 3600.0));
  app.add_option("--radius", options.radius_m,
                 "m around the robot in which the map is published; 0: everything")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--grid-cell", options.grid_cell_m,
                 "m, of grid map and planar terrain; at least the map's resolution")
      ->check(CLI::PositiveNumber);
  app.add_option("--patch-rate", options.patch_hz, "Hz, of patches about the robot; 0: none")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--patch-length", options.patch_length_m, "m, of a patch along the robot's heading")
      ->check(CLI::Range(0.01, 6.0));
  app.add_option("--patch-width", options.patch_width_m, "m, of a patch across it")
      ->check(CLI::Range(0.01, 6.0));
  app.add_option("--patch-cell", options.patch_cell_m, "m, between a patch's places")
      ->check(CLI::Range(0.01, 1.0));
  app.add_option("--foot-radius", options.foot_radius_m, "m, of the planar terrain's insets")
      ->check(CLI::PositiveNumber);
  app.add_option("--max-slope", options.max_slope_deg, "degrees, of planar terrain and grid map")
      ->check(CLI::Range(0.0, 80.0));
  app.add_option("--clearance", options.clearance_m,
                 "m over a foot of the planar terrain that must be free; 0: any")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--threads", options.threads, "result does not depend on it");
  app.option_defaults()->always_capture_default(false);
  add_reading_options(app, options.readings);
  add_parameter_options(app, options.parameters, true);
  require_finite(app);
}

Map start_of(const NodeOptions& options) {
  if (options.scans().empty())
    throw Error(Error::Kind::usage, "--cloud or --depth", "is missing", "name the topic of the scans");
  const ParameterChoice choice(options.parameters, true);
  const bool there = std::filesystem::exists(options.output + ".surfaces");
  if (there && !options.resume && !options.force)
    throw Error(Error::Kind::usage, options.output + ".surfaces", "exists",
                "--resume resumes it, --force overwrites it");
  if (!there || options.force) {
    const bool camera = options.takes_depth() || options.readings.sensor == SensorKind::depth_camera;
    return Map(choice.in_force({}, camera ? SensorKind::depth_camera : SensorKind::lidar));
  }
  LoadedMap loaded = load_map(options.output);
  choice.require_same(loaded.map.parameters());
  surfaces::state_of(loaded.map).parameters.up = choice.up_over(loaded.map.parameters());
  if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
  return std::move(loaded.map);
}

}  // namespace octosurf::node
