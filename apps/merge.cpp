// `octosurf merge`: two maps into one.
#include "degrees.hpp"
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

constexpr const char* merge_description = R"(Merges two maps into one.

Examples:
  octosurf merge maps/east maps/west -o maps/house                       both in one frame
  octosurf merge maps/east maps/west -o maps/house --pose 4.2 0.1 0 0 0 90
  octosurf merge maps/east maps/west -o maps/house --pose-file T_east_west.txt --align
  octosurf merge maps/monday maps/tuesday -o maps/monday --force         into the first one's files

The second map is taken into the first: its frame, its parameters and the ids of its surfaces stay. What both know of a
voxel counts as independent readings, so maps must not share scans; where one has seen a surface and the other
free space, the sum decides. The second's surfaces go on in those of the first with which they are one plane;
the others keep their planes and get new ids. Both maps need the same resolution, and stay as they are.

--pose is where the second map's frame lies in the first's: metres, then degrees, turned about x first, then
y, then z; it must be right to about a voxel. Without, both have the same frame. --align makes it so from a
guess, by the surfaces that both maps have: it refuses to merge where they do not fit within --reach and
--turn. The merged map can be gone on with (map --resume); the scans of both are not kept with it.
)";

struct MergeOptions {
  std::string first, second, output, pose_file, report;
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
    LoadedMap first = load(options_.first);
    const LoadedMap second = load(options_.second);
    require_other_scans(first, second);
    before_ = first.map.snapshot();
    size_before_ = first.map.size();
    T_first_second_ = pose_of(options_);
    T_first_second_ *= Eigen::Translation3d(second.map.origin() - first.map.origin());
    if (options_.align)
      align(second.map);
    else if (!options_.anyway)
      require_pose(second.map);
    Mapper mapper(std::move(first.map), 1, paper_detector());
    report_ = mapper.merge(second.map, T_first_second_);
    if (!options_.anyway) require_fit(mapper.map(), second.map);
    save_map(mapper.map(), options_.output);
    wall_s_ = std::chrono::duration<double>(Clock::now() - begin_).count();
    if (!options_.report.empty()) write_report(mapper.map(), second.map);
    print_summary(mapper.map(), second.map);
  }

 private:
  using Clock = std::chrono::steady_clock;

  static LoadedMap load(const std::string& name) {
    LoadedMap loaded = load_map(name);
    if (!loaded.warning.empty()) std::fprintf(stderr, "warning: %s\n", loaded.warning.c_str());
    return loaded;
  }

  /// As far as the maps' records show.
  void require_other_scans(const LoadedMap& first, const LoadedMap& second) const {
    const std::vector<std::uint64_t>&held = first.map.state().held, &others = second.map.state().held;
    const std::set<std::uint64_t> known(held.begin(), held.end());
    const auto shared = static_cast<std::size_t>(std::count_if(
        others.begin(), others.end(), [&](std::uint64_t scan) { return known.contains(scan); }));
    if (shared > 0 && !options_.anyway)
      throw Error(Error::Kind::data, options_.second,
                  "holds " + io::count_of(shared, "scan") + " of " + options_.first +
                      ", whose readings would count twice",
                  "merge maps of different scans, --anyway merges them as they are");
    if (first.scans.folder.empty() || second.scans.folder.empty() ||
        !same_file(first.scans.folder, second.scans.folder))
      return;
    throw Error(Error::Kind::data, options_.second,
                "was built from scans of " + options_.first + ", whose readings would count twice",
                "merge maps of different scans");
  }

  void align(const Map& second) {
    alignment_ =
        align_maps(before_, second, T_first_second_, {options_.reach_m, options_.turn_deg / deg_per_rad});
    const Alignment& found = alignment_->scan;
    if (found.outcome != AlignmentOutcome::corrected)
      throw Error(Error::Kind::data, options_.second,
                  found.outcome == AlignmentOutcome::nothing_known
                      ? "has too little in common with " + options_.first + " to be aligned"
                      : "fits " + options_.first + " nowhere within reach, or at several places alike",
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
    throw Error(Error::Kind::data, options_.second, text.data() + options_.first,
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
                  options_.first.c_str(), area, alone, 100 * kept);
    throw Error(Error::Kind::data, options_.second, text.data(),
                std::string(options_.align ? "give a nearer --pose" : "--align finds the pose between them") +
                    ", --anyway merges them as they are");
  }

  void write_report(const Map& merged, const Map& second) const {
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
  std::shared_ptr<const Snapshot> before_;  // the first map's
  Map::Size size_before_;                   // likewise
  Eigen::Isometry3d T_first_second_ = Eigen::Isometry3d::Identity();
  std::optional<MapAlignment> alignment_;
  MergeReport report_;
  double wall_s_ = 0;
};

/// Rejects outputs that cannot or must not be written, before any work is done.
void probe_merge_outputs(const MergeOptions& options) {
  const std::vector<std::string> first = files_of_map(options.first), second = files_of_map(options.second),
                                 written = files_of_map(options.output);
  if (same_file(first.front(), second.front()))
    throw Error(Error::Kind::usage, options.second,
                "is the first map itself, whose readings would count twice", "give another one");
  for (const std::string& file : written) require_apart("-o", file, {options.pose_file});
  for (const std::vector<std::string>& files : {first, second, written})
    require_apart("--report", options.report, files);
  require_apart("--report", options.report, {options.pose_file});
  make_folder_of(options.output);
  const auto probe = [&](const std::string& file) {
    if (!file.empty()) io::NewFile(file, options.force).write([](std::ostream&) {});
  };
  for (const std::string& file : written) probe(file);
  probe(options.report);
}

void run_merge(const MergeOptions& options) {
  probe_merge_outputs(options);
  Merge(options).run();
}

}  // namespace

void add_merge(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("merge", merge_description);
  const auto options = std::make_shared<MergeOptions>();
  verb->add_option("first", options->first, "map whose frame, parameters and ids stay")->required();
  verb->add_option("second", options->second, "map that is taken in")->required();
  verb->add_option("-o,--output", options->output, "map to write: name without ending")->required();
  auto* pose = verb->add_option("--pose", options->pose,
                                "X Y Z ROLL PITCH YAW: the second map's frame in the first's, m and degrees")
                   ->expected(6);
  verb->add_option("--pose-file", options->pose_file,
                   "the same from a file with one pose; the formats of map's --poses")
      ->excludes(pose);
  auto* align = verb->add_flag("--align", options->align,
                               "find the pose by the surfaces of both; what is given is a guess");
  verb->add_option("--reach", options->reach_m, "m by which the guess may be off")
      ->needs(align)
      ->capture_default_str();
  verb->add_option("--turn", options->turn_deg, "degrees by which it may be turned")
      ->needs(align)
      ->capture_default_str();
  verb->add_option("--report", options->report, "write what became of what to this file (JSON)");
  verb->add_flag("--anyway", options->anyway, "merge maps that do not fit, too");
  verb->add_flag("--force", options->force, "overwrite map and report");
  verb->callback([options] { run_merge(*options); });
}

}  // namespace octosurf
