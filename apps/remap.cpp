// `octosurf remap`: a map anew, from the scans it was built from and corrected poses.
#include "bounds.hpp"
#include "geometry/interruption.hpp"
#include "interrupt_guard.hpp"
#include "io/kept_scans.hpp"
#include "io/map_lock.hpp"
#include "io/new_file.hpp"
#include "io/readers/recorded_scan.hpp"
#include "io/text_file.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "pose_log.hpp"
#include "progress.hpp"
#include "run_statistics.hpp"
#include "sensing/downsample.hpp"
#include "succession.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

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

struct RemapOptions {
  std::string map, poses, output, scans, report, write_poses;
  std::vector<double> origin;
  int threads = 1;
  bool force = false, strict = false;
};

/// One run of `octosurf remap`.
class Remap {
 public:
  explicit Remap(const RemapOptions& options)
      : options_(options),
        before_(load_with_warning(options.map)),
        origin_(options.origin.empty() ? before_.map.origin() : Eigen::Vector3d(options.origin.data())),
        statistics_(before_.map.parameters()),
        poses_log_(options.write_poses, options.force, origin_) {
    context_.input = {options.map};
    if (!before_.warning.empty()) context_.warnings.push_back(before_.warning);
  }

  void run() {
    find_scans();
    const Parameters parameters = before_.map.parameters();
    Parameters as_given = parameters;
    as_given.align = false;  // these poses are corrected already
    Mapper mapper(as_given, options_.threads, paper_detector());
    insert_all(mapper);
    Map map = std::move(mapper).release();
    map.set_origin(origin_);
    surfaces::state_of(map).parameters = parameters;
    const Succeeded surfaces = renumber(surfaces::state_of(map));
    geometry::end_if_interrupted();
    save(map, surfaces);
  }

 private:
  using Clock = std::chrono::steady_clock;
  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  void find_scans() {
    const std::uint64_t scans = before_.map.size().scans;
    const fs::path folder = options_.scans.empty() ? before_.scans.folder : fs::path(options_.scans);
    if (folder.empty() || before_.scans.poses.empty())
      throw Error(Error::Kind::usage, options_.map, "the scans it was built from are not kept",
                  "build it with octosurf map --keep-scans");
    if (!options_.poses.empty()) source_.poses = options_.poses;
    list_ = io::list_scans(io::kept_scans(folder, scans, before_.scans.marks), source_);
    if (!list_.left_out.empty())
      throw Error(Error::Kind::data, "", list_.left_out.front(), "give a trajectory that covers all scans");
    for (const std::string& note : list_.notes) std::printf("%s\n", note.c_str());
    const bool in_place = writes_over(options_.map, options_.output);
    kept_ = {folder, before_.scans.shared || !in_place, {}, before_.scans.marks};
  }

  const std::vector<io::ListedScan>& scans() const { return list_.recordings.front().scans; }

  /// At its new pose; without new ones that of the old map.
  Scan read(std::size_t i) const {
    Scan scan = io::read_posed(list_.recordings.front(), scans()[i], source_).scan;
    scan.stamp_s = *scans()[i].stamp_s;
    if (options_.poses.empty())
      scan.T_map_sensor = Eigen::Translation3d(before_.map.origin()) * before_.scans.poses[i];
    scan.T_map_sensor.translation() -= origin_;
    return scan;
  }

  void insert_all(Mapper& mapper) {
    Progress progress(scans().size());
    std::optional<double> last_stamp_s;
    for (std::size_t i = 0; i < scans().size(); ++i) {
      const Scan scan = read(i);
      kept_.poses.push_back(scan.T_map_sensor);
      if (is_pause(last_stamp_s, scan.stamp_s)) drain(mapper);
      last_stamp_s = scan.stamp_s;
      const double arrival_s = now_s();
      ScanReport report = mapper.insert(scan);
      const double done_s = now_s();
      report.total_ms = 1e3 * (done_s - arrival_s);
      statistics_.add(scan, report, arrival_s, done_s);
      poses_log_.add(scan.stamp_s, report.alignment.T_map_sensor);
      progress.show(i + 1, [&] { return io::count_of(mapper.snapshot()->surfaces.size(), "surface"); });
    }
    drain(mapper);
  }

  void drain(Mapper& mapper) {
    statistics_.drain(mapper, [this] { return now_s(); });
  }

  /// Matches old and new surfaces by the readings they share: of each scan one in every voxel it ends in.
  Succeeded renumber(surfaces::MapState& after) const {
    Succession succession(surfaces::state_of(before_.map));
    const geometry::VoxelGrid& grid = after.occupancy.grid();
    sensing::Downsampler by_voxel(grid);
    const double min_range = after.parameters.occupancy.min_range;
    for (std::size_t i = 0; i < scans().size(); ++i) {
      geometry::end_if_interrupted();
      const Eigen::Isometry3d& T_before = before_.scans.poses[i];
      const Eigen::Isometry3d T_now_before = kept_.poses[i] * T_before.inverse();
      const double unlimited = std::numeric_limits<double>::infinity();
      for (const sensing::EndVoxel& end : by_voxel(read(i), T_before, min_range, unlimited).ends) {
        geometry::VoxelKey now;
        const bool inside = grid.key_of((T_now_before * end.centroid.cast<double>()).cast<float>(), now);
        succession.add(end.key, after, inside ? std::optional(now) : std::nullopt);
      }
    }
    return succession.renumber(after);
  }

  void save(const Map& map, const Succeeded& surfaces) {
    if (options_.strict) require_agreement(statistics_.judgement(), options_.output);
    context_.warn(save_map(map, options_.output, kept_));
    poses_log_.save(Saving::end);
    context_.wall_s = now_s();
    if (!options_.report.empty()) write_report(map, surfaces);
    print_summary(map, surfaces);
  }

  void write_report(const Map& map, const Succeeded& surfaces) const {
    auto report = nlohmann::ordered_json::parse(statistics_.to_json(map, context_));
    report["remap"] = {{"kept", surfaces.kept}, {"new", surfaces.born}, {"gone", surfaces.gone}};
    io::write_file(options_.report, options_.force,
                   [&](std::ostream& out) { out << report.dump(1) << '\n'; });
  }

  void print_summary(const Map& map, const Succeeded& surfaces) const {
    const std::size_t count = scans().size();
    std::printf("%-12s %zu\n", "scans", count);
    std::printf("%-12s %zu: %zu as before, %zu new; %zu of those before are gone\n", "surfaces",
                map.size().surfaces, surfaces.kept, surfaces.born, surfaces.gone.size());
    print_agreement(statistics_.judgement());
    std::printf("%-12s %zu of %zu points\n", "pending", map.size().pending, map.size().points);
    std::printf("%-12s %.1f s; %.1f ms a scan, of which mapping %.1f ms\n", "time", now_s(),
                1e3 * now_s() / static_cast<double>(count), statistics_.scan_ms().percentile(0.5));
    const std::vector<std::string> files = files_of_map(options_.output);
    std::printf("%-12s %s, %s", "written", files[0].c_str(), files[1].c_str());
    for (const std::string& file : {options_.write_poses, options_.report})
      if (!file.empty()) std::printf(", %s", file.c_str());
    std::printf("\n");
    std::fflush(stdout);
    warn_of(statistics_.judgement());
  }

  const RemapOptions& options_;
  Clock::time_point begin_ = Clock::now();
  LoadedMap before_;
  Eigen::Vector3d origin_;  // of the new map
  RunStatistics statistics_;
  PoseLog poses_log_;
  RunContext context_;
  KeptScans kept_;  // of the new map
  ScanSourceOptions source_;
  io::ScanList list_;  // of one recording
};

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
  if (options.output.empty()) options.output = options.map;
  probe_remap_outputs(options);
  const InterruptGuard guard;
  const io::MapLock lock(options.output);
  Remap(options).run();
}

}  // namespace

void add_remap(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("remap", remap_description);
  const auto options = std::make_shared<RemapOptions>();
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
