// `octosurf map`: scans in, map out.
#include "bounds.hpp"
#include "command_line.hpp"
#include "io/map_lock.hpp"
#include "io/new_file.hpp"
#include "io/text_file.hpp"
#include "locate.hpp"
#include "map_run.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "parameter_options.hpp"
#include "scan_feed.hpp"
#include "scan_keeper.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr const char* map_description = R"(Builds a map from posed scans, or continues one.

Examples:
  octosurf map kitchen -o maps/kitchen                          a folder of depth images with poses
  octosurf map kitchen -o maps/kitchen --resolution 0.01 --report kitchen.json
  octosurf map more -o maps/kitchen --resume maps/kitchen       continue a map with the scans it does not have
  octosurf map today -o maps/kitchen --resume maps/kitchen --locate   its poses in any frame about the vertical
  octosurf map depth --poses trajectory.txt --intrinsics K.txt --depth-scale 5000 -o maps/lab
  octosurf map velodyne --poses poses.txt --resolution 0.05 -o maps/street
  octosurf map walk.mcap -o maps/walk                           a bag; info walk.mcap tells its topics
  octosurf map old.bt -o maps/old                               surfaces of an OctoMap
  octosurf map edited.bt --resume maps/old -o maps/new          its ids, on the occupancy of an OctoMap
  octosurf map kitchen -o maps/live --realtime --checkpoint 10  as a robot would see it
  octosurf map kitchen -o maps/live --realtime --serve 8080     a page that follows it: http://127.0.0.1:8080/
  octosurf map kitchen -o maps/kitchen --up auto                 where z is not up, as in a camera's frame
  octosurf map kitchen -o maps/kitchen --keep-scans maps/kitchen.scans   so that remap can move it later
  octosurf map year/*.mcap -o parts/03 --skip 2000 --first 1000   one of several runs, for merge to join

Inputs, recognised by content: folders as 7-Scenes, TUM RGB-D or KITTI velodyne have them; 16-bit depth
images (PNG, PGM); clouds (PCD, PLY); bags of ROS 1 (.bag) and ROS 2 (.db3, .mcap, or their folder);
OctoMap's .graph, .bt and .ot. Several are mapped one after the other. Where a bag has only one topic, camera
or source of poses that fits, it is used and named. -o maps/x writes maps/x.surfaces (everything) and maps/x.bt
(plain OctoMap), every minute and at the end. Ctrl-C, SIGTERM or a lost terminal end the run after the current
scan and save; on other failures (disk full, out of memory) the error names the last complete checkpoint.

--keep-scans DIR keeps each scan as a PCD, 12 bytes a pixel or point. remap rebuilds the map from them with
corrected poses; map reads them like other scans. A map that is resumed and saved under its own name continues
its folder. With another -o give --keep-scans a copy of it (cp -al).

--detector paper uses PCL's parts and the paper's values, where no other is given: no cylinders, poses as they are.
)";

struct Inputs {
  std::optional<fs::path> octree;  ///< .bt or .ot that the map starts from, or whose occupancy it takes over
  std::vector<fs::path> scans;
};

Inputs sort_inputs(const MapOptions& options) {
  Inputs inputs;
  for (const std::string& input : options.inputs) {
    if (!is_occupancy_map(input))
      inputs.scans.emplace_back(input);
    else if (inputs.octree)
      throw Error(Error::Kind::usage, input, "is a second octree", "give one .bt or .ot");
    else
      inputs.octree = input;
  }
  return inputs;
}

bool goes_on_in_place(const MapOptions& options) {
  return !options.resume.empty() && writes_over(options.resume, options.output);
}

bool is_octree_of(const std::string& map, const fs::path& file) {
  return same_file(file, files_of_map(map).back());
}

/// Rejects outputs that equal an input of the run, except the resumed map and its octree, or that cannot be
/// written, before any work is done.
void probe_map_outputs(const MapOptions& options) {
  std::vector<std::string> read = options.inputs;
  read.push_back(options.source.poses.value_or("").string());
  read.push_back(options.source.intrinsics.value_or("").string());
  read.push_back(options.parameters.config);
  for (const std::string& file : files_of_map(options.output))
    for (const std::string& input : read)
      if (fs::is_regular_file(input) && !(goes_on_in_place(options) && is_octree_of(options.resume, input)))
        require_apart("-o", file, {input});
  require_apart("--keep-scans", options.keep_scans, read);
  if (!options.resume.empty())
    for (const std::string& file : files_of_map(options.resume)) read.push_back(file);
  require_outputs(options.output, goes_on_in_place(options), options.report, options.write_poses,
                  options.force, read);
}

/// The map the run starts from: a saved one, an octree, or an empty one for that sensor.
Map start_of(const MapOptions& options, const ParameterChoice& choice, const Inputs& inputs,
             SensorKind sensor, RunContext& context, KeptScans& kept) {
  if (const std::string note = inputs.octree ? octomap_note(*inputs.octree) : ""; !note.empty())
    std::printf("%s\n", note.c_str());
  if (!options.resume.empty()) {
    LoadedMap loaded = load_map(options.resume);
    choice.require_same(loaded.map.parameters());
    surfaces::state_of(loaded.map).parameters.up = choice.up_over(loaded.map.parameters());
    if (inputs.octree && is_octree_of(options.resume, *inputs.octree))
      loaded.warning.clear();  // it is what the run takes over
    context.warn(loaded.warning);
    kept = std::move(loaded.scans);
    return std::move(loaded.map);
  }
  if (!inputs.octree) return Map(choice.in_force({}, sensor));
  return map_from_octomap(*inputs.octree, choice.in_force(read_octomap_resolution(*inputs.octree)));
}

bool goes_on(const MapOptions& options, const Inputs& inputs) {
  return !options.resume.empty() || inputs.octree;
}

/// With the scans that will be read, and the origin of a map that goes on.
ScanSourceOptions source_options(const MapOptions& options, double resolution, const Map* before) {
  ScanSourceOptions source = options.source;
  constexpr double half_of_octree = 16384;  // voxels from its middle: as much is left to move in
  source.origin_beyond_m = std::min(source.origin_beyond_m, half_of_octree * resolution);
  source.skip = options.range.skip;
  const std::size_t every = options.range.every;
  if (options.range.first <= source.first / every) source.first = options.range.first * every;
  if (before == nullptr) return source;
  if (source.origin && *source.origin != before->origin())
    throw Error(Error::Kind::usage, "--origin", "is that of the map, " + io::text_of(before->origin()),
                "leave it away");
  source.origin = before->origin();
  return source;
}

void run_map(MapOptions& options) {
  const auto begin = RunState::Clock::now();
  const ParameterChoice choice(options.parameters, options.realtime);
  options.output = io::file_of_map(options.output.empty() ? options.resume : options.output, "").string();
  options.resume = io::file_of_map(options.resume, "").string();
  if (options.output.empty())
    throw Error(Error::Kind::usage, "-o", "is missing", "name the map to write, as in -o maps/office");
  if (options.resume.empty()) choice.in_force();  // reject invalid values before reading anything
  probe_map_outputs(options);
  const Inputs inputs = sort_inputs(options);
  RunContext context;
  context.input = options.inputs;
  const io::MapLock lock(options.output);
  KeptScans before;
  std::optional<Map> start;
  std::unique_ptr<ScanSource> source;
  if (goes_on(options, inputs)) start = start_of(options, choice, inputs, {}, context, before);
  if (!inputs.scans.empty()) {
    const Parameters parameters = start ? start->parameters() : choice.in_force();
    const ScanSourceOptions how =
        source_options(options, parameters.occupancy.resolution, start ? &*start : nullptr);
    if (options.locate)
      options.range.T_map_poses = locate(
          *start, options.resume, ScanFeed(open_scans(inputs.scans, how), options.range), !options.no_up);
    source = open_scans(inputs.scans, how);
  }
  if (!start) {
    start = start_of(options, choice, inputs, source->sensor(), context, before);
    if (const std::string said = choice.said_of(source->sensor()); !said.empty())
      std::printf("%s\n", said.c_str());
  }
  if (source) start->set_origin(source->origin());
  ScanKeeper keeper(choose_folder(options.keep_scans, goes_on_in_place(options), *start, before, context));
  MapRun mapping(options, *std::move(start), std::move(keeper), std::move(context), begin);
  mapping.run(inputs.octree, std::move(source));
}

}  // namespace

void add_map(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("map", map_description);
  const auto options = std::make_shared<MapOptions>();
  verb->add_option("input", options->inputs, "folders or files")->required();
  verb->add_option("-o,--output", options->output, "map to write: name without ending [that of --resume]");
  verb->add_option(
          "--resume", options->resume,
          "map to continue; may be the one of -o. It takes over the occupancy of an input that is an "
          "OctoMap (.bt, .ot), where its surfaces stay and grow on their planes")
      ->type_name("MAP");
  verb->add_flag("--locate", options->locate,
                 "find by the first scans where in the resumed map they were taken")
      ->needs("--resume");
  verb->add_flag("--no-up", options->no_up,
                 "with --locate: their frame may be tilted; a level plane says how")
      ->needs("--locate");
  verb->add_option("--report", options->report, "write a report of the run to this file (JSON)")
      ->type_name("FILE");
  verb->add_option("--keep-scans", options->keep_scans, "keep the scans in this folder, for remap")
      ->type_name("FOLDER");
  verb->add_option("--write-poses", options->write_poses,
                   "write the poses with which this run's scans were mapped (stamp tx ty tz qx qy qz qw)")
      ->type_name("FILE");
  verb->add_option("--checkpoint", options->checkpoint_s,
                   "save every SECONDS, between scans; 0: only at the end")
      ->check(at_least(0))
      ->capture_default_str();
  verb->add_flag("--realtime", options->realtime,
                 "scans arrive at their time stamps; when mapping falls behind, waiting scans are mapped "
                 "together. Sets --detection-budget to 1000 if it is not given");
  verb->add_option("--serve", options->serve_port,
                   "serve the map while it grows, as the verb serve does; 0: any free port [not served]")
      ->type_name("PORT");
  add_threads(*verb, options->threads);
  verb->add_flag("--force", options->force, "overwrite map and report");
  verb->add_flag("--strict", options->strict, "write no map if scans contradict each other; exit code 1");
  add_scan_options(*verb, options->source, options->range);
  add_parameter_options(*verb, options->parameters);
  verb->callback([&app, verb, options] {
    options->check = "octosurf check" + words_for(*app.get_subcommand("check"), *verb, {});
    run_map(*options);
  });
}

}  // namespace octosurf
