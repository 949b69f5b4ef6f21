// `octosurf remap`: a map anew, from the scans it was built from and corrected poses.
#include "io/kept_scans.hpp"
#include "io/new_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/readers/scan_list.hpp"
#include "io/text_file.hpp"
#include "output_files.hpp"
#include "pose_log.hpp"
#include "progress.hpp"
#include "run_statistics.hpp"
#include "sensing/downsample.hpp"
#include "succession.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
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

The map must have been built with `octosurf map --keep-scans DIR`. Its parameters stay. Poses: one for each scan in
order, or a stamped trajectory that covers all of them, in the formats of map's --poses. Without --poses the map's
own poses are used.

A new surface keeps the id of an old one if the smaller of the two shares at least half of its readings with the
other. Other surfaces get new ids, with the surface they came from as parent. Every surface counts as changed, and
the map's revision is raised by one. With -o the scans still belong to the old map: to continue the new one, give
map --keep-scans a new folder.
)";

struct RemapOptions {
  std::string map, poses, output, scans, report, write_poses;
  int threads = 1;
  bool force = false;
};

/// One run of `octosurf remap`.
class Remap {
 public:
  explicit Remap(const RemapOptions& options)
      : options_(options),
        before_(load_map(options.map)),
        statistics_(before_.map.parameters()),
        poses_log_(options.write_poses, options.force, before_.map.origin()) {
    context_.input = {options.map};
    context_.warn(before_.warning);
  }

  void run() {
    find_scans();
    find_poses();
    if (!options_.poses.empty())
      for (Eigen::Isometry3d& pose : kept_.poses) pose.translation() -= before_.map.origin();
    const Parameters parameters = before_.map.parameters();
    Parameters as_given = parameters;
    as_given.alignment.enabled = false;  // these poses are corrected already
    Mapper mapper(as_given, options_.threads, paper_detector());
    insert_all(mapper);
    Map map = std::move(mapper).release();
    map.set_origin(before_.map.origin());
    surfaces::state_of(map).parameters = parameters;
    const Identities identities = identify(surfaces::state_of(map));
    renumber(surfaces::state_of(map), identities);
    save(map, identities);
  }

 private:
  using Clock = std::chrono::steady_clock;
  double now_s() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

  void find_scans() {
    const std::uint64_t scans = before_.map.size().scans;
    const fs::path folder = options_.scans.empty() ? before_.scans.folder : fs::path(options_.scans);
    if (folder.empty() || scans == 0)
      throw Error(Error::Kind::usage, options_.map, "the scans it was built from are not kept",
                  "build it with octosurf map --keep-scans");
    files_ = io::kept_scans(folder, scans);
    for (const fs::path& file : files_) stamps_.push_back(*io::stamp_in_name(file));
    kept_ = {folder, before_.scans.shared || !in_place(), {}};
  }

  bool in_place() const {
    return same_file(files_of_map(options_.map).front(), files_of_map(options_.output).front());
  }

  /// Without new ones those of the old map.
  void find_poses() {
    if (options_.poses.empty()) {
      kept_.poses = before_.scans.poses;
      return;
    }
    const io::PoseFile file = io::read_poses(options_.poses);
    if (!file.stamped || is_one_for_each(file)) {
      if (file.poses.size() != files_.size())
        throw Error(
            Error::Kind::data, options_.poses,
            std::to_string(file.poses.size()) + " poses for " + std::to_string(files_.size()) + " scans",
            "give one pose per scan, in the order of the scans, or a stamped trajectory");
      for (const io::FilePose& pose : file.poses) kept_.poses.push_back(io::rigid(pose.T, pose.where));
      return;
    }
    const io::Trajectory trajectory = io::trajectory_of(file.poses);
    const std::int64_t gap_ns = io::to_ns(io::largest_pose_gap_s);
    for (std::size_t i = 0; i < files_.size(); ++i) {
      if (!trajectory.covers(io::to_ns(stamps_[i]), gap_ns))
        throw Error(Error::Kind::data, files_[i].string(), "no pose in " + options_.poses + " at its time",
                    "give a trajectory that covers all scans");
      kept_.poses.push_back(trajectory.at(io::to_ns(stamps_[i]), gap_ns));
    }
  }

  /// One pose per scan, with equal times: no look-up by time is needed, and duplicate stamps do no harm.
  bool is_one_for_each(const io::PoseFile& file) const {
    constexpr double rounding_s = 1e-6;
    return std::equal(file.poses.begin(), file.poses.end(), stamps_.begin(), stamps_.end(),
                      [](const io::FilePose& pose, double stamp_s) {
                        return std::fabs(*pose.stamp_s - stamp_s) <= rounding_s;
                      });
  }

  void insert_all(Mapper& mapper) {
    Progress progress(files_.size());
    for (std::size_t i = 0; i < files_.size(); ++i) {
      Scan scan = io::read_kept_scan(files_[i]);
      scan.T_map_sensor = kept_.poses[i];
      if (i > 0 && is_pause(stamps_[i - 1], scan.stamp_s)) drain(mapper);
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

  /// Which surfaces are which: by where readings, of each voxel that a scan ends in their mean, lie in both
  /// maps.
  Identities identify(const surfaces::MapState& after) const {
    Succession succession(surfaces::state_of(before_.map), after);
    const geometry::VoxelGrid& grid = after.occupancy.grid();
    sensing::Downsampler by_voxel(grid);
    const double min_range = after.parameters.occupancy.min_range;
    for (std::size_t i = 0; i < files_.size(); ++i) {
      const Eigen::Isometry3d& T_before = before_.scans.poses[i];
      const Eigen::Isometry3d T_now_before = kept_.poses[i] * T_before.inverse();
      const double unlimited = std::numeric_limits<double>::infinity();
      for (const sensing::EndVoxel& end :
           by_voxel(io::read_kept_scan(files_[i]), T_before, min_range, unlimited).ends) {
        geometry::VoxelKey now;
        if (grid.key_of((T_now_before * end.centroid.cast<double>()).cast<float>(), now))
          succession.add(end.key, now);
        else
          succession.add_lost(end.key);
      }
    }
    return succession.settle();
  }

  void save(const Map& map, const Identities& identities) {
    save_map(map, options_.output, kept_);
    poses_log_.save(Saving::end);
    context_.wall_s = now_s();
    if (!options_.report.empty()) write_report(map, identities);
    print_summary(map, identities);
  }

  void write_report(const Map& map, const Identities& identities) const {
    auto report = nlohmann::ordered_json::parse(statistics_.to_json(map, context_));
    report["remap"] = {{"kept", identities.kept}, {"new", identities.born}, {"gone", identities.gone}};
    io::NewFile file(options_.report, options_.force);
    file.write([&](std::ostream& out) { out << report.dump(1) << '\n'; });
    file.commit();
  }

  void print_summary(const Map& map, const Identities& identities) const {
    const double scans = static_cast<double>(files_.size());
    std::printf("%-12s %zu\n", "scans", files_.size());
    std::printf("%-12s %zu: %zu as before, %zu new; %zu of those before are gone\n", "surfaces",
                map.size().surfaces, identities.kept, identities.born, identities.gone.size());
    std::printf("%-12s %zu of %zu points\n", "pending", map.size().pending, map.size().points);
    std::printf("%-12s %.1f s; %.1f ms a scan, of which mapping %.1f ms\n", "time", now_s(),
                1e3 * now_s() / scans, statistics_.scan_ms_percentile(0.5));
    const std::vector<std::string> files = files_of_map(options_.output);
    std::printf("%-12s %s, %s", "written", files[0].c_str(), files[1].c_str());
    for (const std::string& file : {options_.write_poses, options_.report})
      if (!file.empty()) std::printf(", %s", file.c_str());
    std::printf("\n");
  }

  const RemapOptions& options_;
  Clock::time_point begin_ = Clock::now();
  LoadedMap before_;
  RunStatistics statistics_;
  PoseLog poses_log_;
  RunContext context_;
  KeptScans kept_;               // of the new map
  std::vector<fs::path> files_;  // of its scans
  std::vector<double> stamps_;   // of each
};

/// Rejects outputs that cannot or must not be written, before any work is done.
void probe_remap_outputs(const RemapOptions& options) {
  const std::vector<std::string> read = files_of_map(options.map), written = files_of_map(options.output);
  const bool in_place = same_file(read.front(), written.front());
  for (const auto& [option, file] :
       {std::pair("--report", options.report), std::pair("--write-poses", options.write_poses)}) {
    require_apart(option, file, read);
    require_apart(option, file, written);
    require_apart(option, file, {options.poses, options.scans});
  }
  require_apart("--write-poses", options.write_poses, {options.report});
  for (const std::string& file : written) require_apart("-o", file, {options.poses, options.scans});
  make_folder_of(options.output);
  for (const std::string& file : written) require_writable(file, options.force || in_place);
  for (const std::string& file : {options.report, options.write_poses}) require_writable(file, options.force);
}

void run_remap(RemapOptions& options) {
  if (options.output.empty()) options.output = options.map;
  probe_remap_outputs(options);
  const io::MapLock lock = lock_map(options.output);
  Remap(options).run();
}

}  // namespace

void add_remap(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("remap", remap_description);
  const auto options = std::make_shared<RemapOptions>();
  options->threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 256u));
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
  verb->add_option("--threads", options->threads, "number of threads; the result does not depend on it")
      ->capture_default_str();
  verb->add_flag("--force", options->force, "overwrite map, report and poses");
  verb->callback([options] { run_remap(*options); });
}

}  // namespace octosurf
