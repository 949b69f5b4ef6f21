// `octosurf merge`: several maps into one.
#include "geometry/degrees.hpp"
#include "io/map_file/map_file.hpp"
#include "io/new_file.hpp"
#include "io/readers/pose_file.hpp"
#include "io/text_file.hpp"
#include "output_files.hpp"
#include "surface_table.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/map_alignment.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf {
namespace {

namespace fs = std::filesystem;

constexpr const char* merge_description = R"(Merges maps into one.

Examples:
  octosurf merge maps/east maps/west -o maps/house                       both in one frame
  octosurf merge maps/east maps/west -o maps/house --pose 4.2 0.1 0 0 0 90
  octosurf merge maps/east maps/west -o maps/house --pose-file T_east_west.txt --align
  octosurf merge maps/monday maps/tuesday -o maps/monday --force         into the first one's files
  octosurf merge parts/01 parts/02 parts/03 -o maps/archive              any number, all in one frame

The second map is merged into the first, whose frame, parameters and surface ids stay. The readings of both count as
independent, so the maps must not share scans; where one saw a surface and the other free space, the sum of their
log-odds decides. Surfaces of the second that lie on a plane of the first continue it; the others keep their planes
and get new ids. The maps need the same parameters. Neither file is changed.

Three or more maps are merged from the largest file to the smallest, so that their order here does not matter: the
bytes are the same. The largest one's ids stay. Merging in groups may give other ids, other log-odds of voxels that
reached a clamp, and other points and planes where several maps overlap.

--pose is the pose of the second map's frame in the first's: metres, then degrees about x, then y, then z. It must be
right to about a voxel. Without it both have the same frame. --align refines a guess by the surfaces of both maps,
and refuses to merge if they do not fit within --reach and --turn. The merged map can be continued (map --resume),
but keeps no scans.
)";

struct MergeOptions {
  std::vector<std::string> maps;
  std::string output, pose_file, report;
  std::vector<double> pose;
  double reach_m = 0.3, turn_deg = 5;
  bool align = false, anyway = false, force = false;
};

Eigen::Isometry3d pose_of(const MergeOptions& options) {
  if (!options.pose_file.empty()) {
    const io::PoseFile file = io::read_poses(options.pose_file);
    if (file.poses.size() != 1)
      throw Error(Error::Kind::data, options.pose_file,
                  "holds " + std::to_string(file.poses.size()) + " poses",
                  "give one, that of the second map's frame in the first's");
    return io::rigid(file.poses.front().T, file.poses.front().where);
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (options.pose.empty()) return T;
  T.translation() = Eigen::Vector3d(options.pose[0], options.pose[1], options.pose[2]);
  // Exactly the identity if not requested otherwise, so that voxels are not resampled.
  constexpr std::array<int, 3> order{2, 1, 0};
  for (const int axis : order)
    if (const double angle = options.pose[3 + static_cast<std::size_t>(axis)] / deg_per_rad; angle != 0)
      T.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
  return io::rigid(T, "--pose");
}

/// One run of `octosurf merge`.
class Merge {
 public:
  explicit Merge(const MergeOptions& options) : options_(options) {}

  void run() {
    names_ = in_order(options_.maps);
    LoadedMap first = load(names_.front());
    std::vector<fs::path> folders{first.scans.folder};
    Mapper mapper(std::move(first.map), 1, paper_detector());
    nlohmann::ordered_json steps = nlohmann::ordered_json::array();
    for (at_ = 1; at_ < names_.size(); ++at_) {
      const LoadedMap second = load(names_[at_]);
      require_other_scans(mapper.map(), folders, second);
      folders.push_back(second.scans.folder);
      take_in(mapper, second.map);
      if (names_.size() > 2) print_step(mapper.map());
      steps.push_back(report_of(mapper.map(), second.map));
      if (at_ + 1 == names_.size()) {
        save_map(mapper.map(), options_.output);
        wall_s_ = std::chrono::duration<double>(Clock::now() - begin_).count();
        if (!options_.report.empty()) write_report(steps);
        if (names_.size() == 2) print_summary(mapper.map(), second.map);
      }
    }
    print_written();
  }

 private:
  using Clock = std::chrono::steady_clock;

  static LoadedMap load(const std::string& name) {
    LoadedMap loaded = load_map(name);
    if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
    return loaded;
  }

  /// Of two, the order given: the first one's ids stay. Of more, one that does not depend on it.
  static std::vector<std::string> in_order(const std::vector<std::string>& names) {
    if (names.size() == 2) return names;
    std::vector<std::pair<io::FileSum, std::string>> sums;
    for (const std::string& name : names)
      sums.emplace_back(io::sum_of(files_of_map(name).front()).value_or(io::FileSum{}), name);
    std::stable_sort(sums.begin(), sums.end(), [](const auto& a, const auto& b) {
      return std::pair(b.first.bytes, b.first.crc32) < std::pair(a.first.bytes, a.first.crc32);
    });
    std::vector<std::string> ordered;
    for (const auto& [sum, name] : sums) ordered.push_back(name);
    return ordered;
  }

  const std::string& into() const { return names_.front(); }
  const std::string& other() const { return names_[at_]; }

  void take_in(Mapper& mapper, const Map& second) {
    require_same_parameters(mapper.map().parameters(), second.parameters());
    before_ = mapper.snapshot();
    size_before_ = mapper.map().size();
    T_first_second_ = pose_of(options_);
    T_first_second_ *= Eigen::Translation3d(second.origin() - mapper.map().origin());
    if (options_.align)
      align(second);
    else if (!options_.anyway)
      require_pose(second);
    report_ = mapper.merge(second, T_first_second_);
    if (!options_.anyway) require_fit(mapper.map(), second);
  }

  /// What surfaces and occupancy mean. Not up, which describes the frame, nor the budget, which only delays.
  void require_same_parameters(const Parameters& ours, const Parameters& theirs) const {
    for (const ParameterInfo& info : parameter_infos()) {
      if (options_.anyway || info.name.starts_with("up_") || info.name == "detection_budget") continue;
      const std::string here = get_parameter(ours, info.name), there = get_parameter(theirs, info.name);
      if (here != there)
        throw Error(Error::Kind::data, other(),
                    "its " + info.name + " is " + there + ", that of " + into() + " is " + here,
                    "build one of them anew with the other's parameters" +
                        std::string(info.name == "resolution" ? "" : ", --anyway merges them as they are"));
    }
  }

  /// As far as the maps' records show.
  void require_other_scans(const Map& first, const std::vector<fs::path>& folders,
                           const LoadedMap& second) const {
    const std::vector<std::uint64_t>&held = surfaces::state_of(first).held,
          &others = surfaces::state_of(second.map).held;
    const std::set<std::uint64_t> known(held.begin(), held.end());
    const auto shared = static_cast<std::size_t>(std::count_if(
        others.begin(), others.end(), [&](std::uint64_t scan) { return known.contains(scan); }));
    if (shared > 0 && !options_.anyway)
      throw Error(
          Error::Kind::data, other(),
          "holds " + io::count_of(shared, "scan") + " of " + into() + ", whose readings would count twice",
          "merge maps of different scans, --anyway merges them as they are");
    const auto is_its = [&](const fs::path& folder) {
      return !folder.empty() && same_file(folder, second.scans.folder);
    };
    if (second.scans.folder.empty() || std::none_of(folders.begin(), folders.end(), is_its)) return;
    throw Error(Error::Kind::data, other(),
                "was built from scans of " + into() + ", whose readings would count twice",
                "merge maps of different scans");
  }

  void align(const Map& second) {
    alignment_ =
        align_maps(before_, second, T_first_second_, {options_.reach_m, options_.turn_deg / deg_per_rad});
    const Alignment& found = alignment_->scan;
    if (found.outcome != AlignmentOutcome::corrected)
      throw Error(Error::Kind::data, other(),
                  found.outcome == AlignmentOutcome::nothing_known
                      ? "has too little in common with " + into() + " to be aligned"
                      : "fits " + into() + " nowhere within reach, or at several places alike",
                  "give a nearer --pose, more --reach and --turn, or merge without --align");
    T_first_second_ = alignment_->T_map_other;
  }

  /// Where both have the same surfaces, these must coincide: if another pose certainly fits better, the given
  /// one is wrong.
  void require_pose(const Map& second) const {
    const MapAlignment found =
        align_maps(before_, second, T_first_second_, {options_.reach_m, options_.turn_deg / deg_per_rad});
    if (found.scan.outcome != AlignmentOutcome::corrected || found.scan.determined < 6) return;
    const Eigen::Isometry3d off = found.T_map_other * T_first_second_.inverse();
    const Eigen::Vector3d place = found.scan.T_map_sensor.translation();
    const double distance = (off * place - place).norm(), turn = Eigen::AngleAxisd(off.linear()).angle();
    const double lever = 1;  // m, from there to the surfaces
    if (distance + lever * turn <= 2 * second.parameters().occupancy.resolution) return;
    std::array<char, 120> text{};
    std::snprintf(text.data(), text.size(), "lies %.1f cm and %.1f° off where its surfaces meet those of ",
                  100 * distance, deg_per_rad * turn);
    throw Error(Error::Kind::data, other(), text.data() + into(),
                "--align merges it there, --anyway where it was said to be");
  }

  std::size_t inliers_of_second() const {
    std::size_t inliers = 0;
    for (const MergedSurface& surface : report_.surfaces) inliers += surface.inliers;
    return inliers;
  }
  std::size_t still_inliers() const {
    std::size_t inliers = 0;
    for (const MergedSurface& surface : report_.surfaces) inliers += surface.on_surfaces;
    return inliers;
  }
  /// Surfaces of the second map that continue in a surface of the first.
  std::size_t going_on() const {
    return static_cast<std::size_t>(
        std::count_if(report_.surfaces.begin(), report_.surfaces.end(), [&](const MergedSurface& surface) {
          return surface.id != 0 && before_->find(surface.id) != nullptr;
        }));
  }
  static std::size_t kept(const Snapshot& before, const Snapshot& after) {
    return static_cast<std::size_t>(std::count_if(before.surfaces.begin(), before.surfaces.end(),
                                                  [&](const SurfacePtr& s) { return after.find(s->id); }));
  }

  /// Two maps of one or adjacent places have together at least the surface area of each. If they do not fit,
  /// rays of one erode the other, or its points lie off all planes.
  void require_fit(const Map& merged, const Map& second) const {
    constexpr double most_lost = 0.1;  // of the area: changes in a place between two recordings
    constexpr double least_kept =
        0.5;  // of the second's inliers: otherwise they are neither on the first's surfaces nor on its own
    const double area = total_area(*merged.snapshot()),
                 alone = std::max(total_area(*before_), total_area(*second.snapshot())),
                 kept = static_cast<double>(still_inliers()) /
                        static_cast<double>(std::max<std::size_t>(1, inliers_of_second()));
    if (area >= (1 - most_lost) * alone && (inliers_of_second() == 0 || kept >= least_kept)) return;
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(),
                  "does not fit %s: %.2f m² of surfaces would be left, where one of them alone has %.2f, and "
                  "%.0f %% of its inliers",
                  into().c_str(), area, alone, 100 * kept);
    throw Error(Error::Kind::data, other(), text.data(),
                std::string(options_.align ? "give a nearer --pose" : "--align finds the pose between them") +
                    ", --anyway merges them as they are");
  }

  nlohmann::ordered_json report_of(const Map& merged, const Map& second) const {
    const auto map_json = [](const Snapshot& snapshot, const Map::Size& size) {
      return nlohmann::ordered_json{
          {"scans", size.scans},       {"points", size.points},           {"pending", size.pending},
          {"surfaces", size.surfaces}, {"area_m2", total_area(snapshot)}, {"revision", size.revision}};
    };
    nlohmann::ordered_json json{{"first", map_json(*before_, size_before_)},
                                {"second", map_json(*second.snapshot(), second.size())},
                                {"merged", map_json(*merged.snapshot(), merged.size())}};
    std::vector<double> T;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) T.push_back(T_first_second_.matrix()(row, column));
    json["T_first_second"] = T;
    const ScanReport& changes = report_.changes;
    json["changes"] = {{"appeared", changes.appeared},
                       {"vanished", changes.vanished},
                       {"out_of_map", changes.points_out_of_map},
                       {"born", changes.born},
                       {"grown", changes.grown},
                       {"shrunk", changes.shrunk},
                       {"merged", changes.merged},
                       {"gone", changes.gone}};
    json["surfaces"] = nlohmann::ordered_json::array();
    for (const MergedSurface& surface : report_.surfaces)
      json["surfaces"].push_back(
          {{"second", surface.other},
           {"merged", surface.id == 0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(surface.id)},
           {"inliers", surface.inliers},
           {"shared", surface.shared},
           {"on_surfaces", surface.on_surfaces}});
    return json;
  }

  /// Of two maps: what became of them. Of more: in `steps`, each that was taken in.
  void write_report(const nlohmann::ordered_json& steps) const {
    nlohmann::ordered_json json = steps.front();
    if (names_.size() > 2)
      json = {{"order", names_}, {"steps", steps}, {"merged", steps.back().at("merged")}};
    json["wall_s"] = wall_s_;
    io::NewFile file(options_.report, options_.force);
    file.write([&](std::ostream& out) { out << json.dump(1) << '\n'; });
    file.commit();
  }

  void print_summary(const Map& merged, const Map& second) const {
    const auto line = [](const char* label, const Snapshot& snapshot, const Map::Size& size) {
      std::printf("%-12s %zu surfaces, %.2f m²; %zu points, %zu of them pending; %llu scans\n", label,
                  size.surfaces, total_area(snapshot), size.points, size.pending,
                  static_cast<unsigned long long>(size.scans));
    };
    line("first", *before_, size_before_);
    line("second", *second.snapshot(), second.size());
    line("merged", *merged.snapshot(), merged.size());
    if (alignment_) print_alignment();
    const std::size_t stayed = kept(*before_, *merged.snapshot());
    std::printf("%-12s %zu of the first stay, %zu are new, %zu are gone or merged\n", "surfaces", stayed,
                merged.size().surfaces - stayed, size_before_.surfaces - stayed);
    std::printf(
        "%-12s %zu of its %zu surfaces go on in the first's; %.1f %% of their points are on surfaces\n",
        "of second", going_on(), report_.surfaces.size(),
        100.0 * static_cast<double>(still_inliers()) /
            static_cast<double>(std::max<std::size_t>(1, inliers_of_second())));
    std::printf("%-12s %zu appeared, %zu vanished\n", "voxels", report_.changes.appeared,
                report_.changes.vanished);
    if (report_.changes.points_out_of_map > 0)
      std::printf("%-12s %zu points outside the octree\n", "dropped", report_.changes.points_out_of_map);
    std::printf("%-12s %.1f s, of which merging %.1f s\n", "time", wall_s_, report_.changes.total_ms / 1e3);
  }

  void print_step(const Map& merged) const {
    if (at_ == 1)
      std::printf("%-12s %s: %zu surfaces, %.2f m², whose ids stay\n", "first", into().c_str(),
                  size_before_.surfaces, total_area(*before_));
    const Map::Size size = merged.size();
    std::printf("%-12s %s: %zu surfaces, %.2f m²; %zu points, %zu of them pending; %llu scans\n", "with",
                other().c_str(), size.surfaces, total_area(*merged.snapshot()), size.points, size.pending,
                static_cast<unsigned long long>(size.scans));
    if (alignment_) print_alignment();
    if (report_.changes.points_out_of_map > 0)
      std::printf("%-12s %zu points outside the octree\n", "dropped", report_.changes.points_out_of_map);
  }

  void print_written() const {
    if (names_.size() > 2) std::printf("%-12s %.1f s\n", "time", wall_s_);
    const std::vector<std::string> files = files_of_map(options_.output);
    std::printf("%-12s %s, %s", "written", files[0].c_str(), files[1].c_str());
    if (!options_.report.empty()) std::printf(", %s", options_.report.c_str());
    std::printf("\n");
  }

  void print_alignment() const {
    const Eigen::Vector3d t = T_first_second_.translation();
    const Eigen::Matrix3d& R = T_first_second_.linear();
    std::printf(
        "%-12s --pose %.4f %.4f %.4f %.3f %.3f %.3f; %d of 6 directions fixed, %.0f %% of %zu readings fit\n",
        "aligned", t.x(), t.y(), t.z(), deg_per_rad * std::atan2(R(2, 1), R(2, 2)),
        deg_per_rad * std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
        deg_per_rad * std::atan2(R(1, 0), R(0, 0)), alignment_->scan.determined,
        100 * alignment_->scan.explained_share(), alignment_->scan.known);
  }

  const MergeOptions& options_;
  Clock::time_point begin_ = Clock::now();
  std::vector<std::string> names_;          // of the maps, in the order in which they are taken in
  std::size_t at_ = 1;                      // the one that is taken in
  std::shared_ptr<const Snapshot> before_;  // of what it is taken into
  Map::Size size_before_;                   // likewise
  Eigen::Isometry3d T_first_second_ = Eigen::Isometry3d::Identity();
  std::optional<MapAlignment> alignment_;
  MergeReport report_;
  double wall_s_ = 0;
};

/// Rejects outputs that cannot or must not be written, before any work is done.
void probe_merge_outputs(const MergeOptions& options) {
  const std::vector<std::string> written = files_of_map(options.output);
  if (options.maps.size() > 2 && !(options.pose.empty() && options.pose_file.empty()))
    throw Error(Error::Kind::usage, "--pose", "is between two maps, and here are more", "merge two by two");
  std::vector<std::string> read;
  for (const std::string& map : options.maps) {
    const std::vector<std::string> files = files_of_map(map);
    for (const std::string& before : read)
      if (same_file(before, files.front()))
        throw Error(Error::Kind::usage, map, "is given twice, and its readings would count twice",
                    "give each map once");
    read.push_back(files.front());
    require_apart("--report", options.report, files);
  }
  for (const std::string& file : written) require_apart("-o", file, {options.pose_file});
  require_apart("--report", options.report, written);
  require_apart("--report", options.report, {options.pose_file});
  make_folder_of(options.output);
  for (const std::string& file : written) require_writable(file, options.force);
  require_writable(options.report, options.force);
}

void run_merge(const MergeOptions& options) {
  probe_merge_outputs(options);
  const io::MapLock lock = lock_map(options.output);
  Merge(options).run();
}

}  // namespace

void add_merge(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("merge", merge_description);
  const auto options = std::make_shared<MergeOptions>();
  verb->add_option(
          "maps", options->maps,
          "the map whose frame, parameters and ids stay, and the one that is merged into it; or more")
      ->required()
      ->expected(2, 1 << 20);
  verb->add_option("-o,--output", options->output, "map to write: name without ending")->required();
  auto* pose =
      verb->add_option(
              "--pose", options->pose,
              "X Y Z ROLL PITCH YAW: the second map's frame in the first's, m and degrees [the same]")
          ->expected(6);
  verb->add_option("--pose-file", options->pose_file,
                   "the same from a file with one pose; the formats of map's --poses")
      ->type_name("FILE")
      ->excludes(pose);
  auto* align = verb->add_flag("--align", options->align,
                               "find the pose by the surfaces of both maps; --pose is a guess");
  verb->add_option("--reach", options->reach_m, "largest error of the guess, m")
      ->needs(align)
      ->capture_default_str();
  verb->add_option("--turn", options->turn_deg, "largest error of its rotation, degrees")
      ->needs(align)
      ->capture_default_str();
  verb->add_option("--report", options->report, "write what became of the surfaces to this file (JSON)")
      ->type_name("FILE");
  verb->add_flag("--anyway", options->anyway, "merge even if the maps do not fit");
  verb->add_flag("--force", options->force, "overwrite map and report");
  verb->callback([options] { run_merge(*options); });
}

}  // namespace octosurf
