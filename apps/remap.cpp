// `octosurf remap`: a map anew, from the scans it was built from and corrected poses.
#include "bounds.hpp"
#include "geometry/interruption.hpp"
#include "interrupt_guard.hpp"
#include "io/kept_scans.hpp"
#include "io/map_lock.hpp"
#include "io/new_file.hpp"
#include "io/readers/scan_list.hpp"
#include "map_run.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "sensing/downsample.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/map.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr const char* remap_description =
    R"(Builds a map anew from the scans it was built from, with corrected poses.

Examples:
  octosurf remap maps/kitchen --poses corrected.txt                    in place
  octosurf remap maps/kitchen --poses corrected.txt -o maps/kitchen2   and leaves the old map as it is
  octosurf remap maps/kitchen --poses optimised.tum --write-poses used.txt --report remap.json
  octosurf remap maps/kitchen --scans /disk/kitchen.scans              the scans have moved; poses as they were
  octosurf remap maps/kitchen --poses utm.txt --origin 448000 5411000 0

The map must have been built with `octosurf map --keep-scans DIR`. Its parameters stay. Poses: one for each scan in
order, or a stamped trajectory that covers all of them, in the formats of map's --poses. Without --poses the map's
own poses are used. As in map, a warning says if the scans contradict each other at these poses.

A new surface keeps the id of the old one with most of its readings, unless that has more in another. Other surfaces
get new ids, with the surface they came from as parent. Every surface counts as changed, and
the map's revision is raised by one. With -o the scans still belong to the old map: to continue the new one, give
map --keep-scans a copy of the folder.
)";

struct RemapOptions : MapOptions {
  std::string map, poses, scans;
  std::vector<double> origin;
};

/// The scans that a map was built from, at corrected poses, or else at those it was built with.
class KeptSource : public ScanSource {
 public:
  /// `folder`: instead of the map's own. Throws Error(data) for a scan that has no pose.
  KeptSource(const LoadedMap& map, const fs::path& folder, const ScanSourceOptions& options)
      : map_(map),
        options_(options),
        list_(io::list_scans(io::kept_scans(folder, map.map.size().scans, map.scans.marks), options)) {
    if (!list_.left_out.empty())
      throw Error(Error::Kind::data, "", list_.left_out.front(), "give a trajectory that covers all scans");
  }

  std::size_t size() const override { return list_.recordings.front().scans.size(); }
  const std::vector<std::string>& skipped() const override { return list_.left_out; }
  std::vector<std::string> notes() const override { return list_.notes; }
  std::optional<Scan> next() override { return at_ < size() ? std::optional(read(at_++)) : std::nullopt; }

  Scan read(std::size_t i) const {
    const io::ListedRecording& recording = list_.recordings.front();
    Scan scan = io::read_posed(recording, recording.scans[i], options_).scan;
    scan.stamp_s = *recording.scans[i].stamp_s;
    if (!options_.poses) scan.T_map_sensor = Eigen::Translation3d(map_.map.origin()) * map_.scans.poses[i];
    scan.T_map_sensor.translation() -= *options_.origin;
    return scan;
  }

 private:
  const LoadedMap& map_;
  ScanSourceOptions options_;
  io::ScanList list_;  // of one recording
  std::size_t at_ = 0;
};

/// Matches old and new surfaces by the readings they share: of each scan one in every voxel it ends in.
surfaces::Succeeded renumber(const LoadedMap& before, const KeptSource& scans,
                             const std::vector<Eigen::Isometry3d>& poses, surfaces::MapState& after) {
  surfaces::Succession succession(surfaces::state_of(before.map));
  const geometry::VoxelGrid& grid = after.occupancy.grid();
  sensing::Downsampler by_voxel(grid);
  const double min_range = after.parameters.occupancy.min_range;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    geometry::end_if_interrupted();
    const Eigen::Isometry3d& T_before = before.scans.poses[i];
    const Eigen::Isometry3d T_now_before = poses[i] * T_before.inverse();
    const double unlimited = std::numeric_limits<double>::infinity();
    for (const sensing::EndVoxel& end : by_voxel(scans.read(i), T_before, min_range, unlimited).ends) {
      geometry::VoxelKey now;
      const bool inside = grid.key_of((T_now_before * end.centroid.cast<double>()).cast<float>(), now);
      succession.add(end.key, after, inside ? std::optional(now) : std::nullopt);
    }
  }
  return succession.renumber(after);
}

/// Rejects outputs that cannot or must not be written, before any work is done.
void probe_remap_outputs(const RemapOptions& options) {
  for (const std::string& file : files_of_map(options.output))
    require_apart("-o", file, {options.poses, options.scans});
  std::vector<std::string> read = files_of_map(options.map);
  read.insert(read.end(), {options.poses, options.scans});
  require_outputs(options.output, writes_over(options.map, options.output), options.report,
                  options.write_poses, options.force, read);
}

void run_remap(RemapOptions& options) {
  const auto begin = RunState::Clock::now();
  options.output = io::file_of_map(options.output.empty() ? options.map : options.output, "").string();
  probe_remap_outputs(options);
  const InterruptGuard guard;
  const io::MapLock lock(options.output);
  const LoadedMap before = load_with_warning(options.map);
  RunContext context;
  context.input = {options.map};
  if (!before.warning.empty()) context.warnings.push_back(before.warning);
  const fs::path folder = options.scans.empty() ? before.scans.folder : fs::path(options.scans);
  if (folder.empty() || before.scans.poses.empty())
    throw Error(Error::Kind::usage, options.map, "the scans it was built from are not kept",
                "build it with octosurf map --keep-scans");
  options.source.depth_scale = 1;  // they are in metres
  if (!options.poses.empty()) options.source.poses = options.poses;
  options.source.origin =
      options.origin.empty() ? before.map.origin() : Eigen::Vector3d(options.origin.data());
  auto source = std::make_unique<KeptSource>(before, folder, options.source);
  const KeptSource again(before, folder, options.source);  // for ids

  const Parameters parameters = before.map.parameters();
  Parameters as_given = parameters;
  as_given.align = false;  // these poses are corrected already
  Map start(as_given);
  start.set_origin(*options.source.origin);
  const bool shared = before.scans.shared || !writes_over(options.map, options.output);
  ScanKeeper keeper({folder, shared, {}, before.scans.marks}, true);
  MapRun run(options, std::move(start), std::move(keeper), std::move(context), begin);
  run.rebuild(std::move(source), [&](Map& map, const std::vector<Eigen::Isometry3d>& poses) {
    surfaces::MapState& state = surfaces::state_of(map);
    state.parameters = parameters;
    return renumber(before, again, poses, state);
  });
}

}  // namespace

void add_remap(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("remap", remap_description);
  const auto options = std::make_shared<RemapOptions>();
  options->checkpoint_s = 0;  // all or nothing
  verb->add_option("map", options->map, "map, built with --keep-scans")->required();
  verb->add_option("--poses", options->poses, "file with a pose per scan, or a stamped trajectory")
      ->type_name("FILE");
  verb->add_option("-o,--output", options->output, "map to write [the same]");
  verb->add_option("--scans", options->scans, "folder of the scans, if it is not where the map says")
      ->type_name("FOLDER");
  verb->add_option("--report", options->report, "write a report of the run to this file (JSON)")
      ->type_name("FILE");
  verb->add_option("--write-poses", options->write_poses,
                   "write the poses with which the scans were mapped (stamp tx ty tz qx qy qz qw)")
      ->type_name("FILE");
  add_threads(*verb, options->threads);
  verb->add_option("--origin", options->origin,
                   "X Y Z: subtracted from all coordinates, m; stored in the map [the map's]")
      ->expected(3);
  verb->add_flag("--strict", options->strict, "write no map if scans contradict each other; exit code 1");
  verb->add_flag("--force", options->force, "overwrite map, report and poses");
  verb->callback([options] { run_remap(*options); });
}

}  // namespace octosurf
