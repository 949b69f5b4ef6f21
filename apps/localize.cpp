// `octosurf localize`: where scans were taken, in a finished map.
#include "geometry/degrees.hpp"
#include "io/new_file.hpp"
#include "locate.hpp"
#include "open_map.hpp"
#include "output_files.hpp"
#include "pose_log.hpp"
#include "scan_feed.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <octosurf/alignment.hpp>
#include <octosurf/error.hpp>
#include <octosurf/map.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

constexpr const char* localize_description = R"(Finds the poses of scans in a finished map.

Examples:
  octosurf localize maps/office more --write-poses found.txt      poses of 7-Scenes, TUM, PCD … scans
  octosurf localize maps/office scan.pcd                          one cloud of a lidar
  octosurf localize maps/office depth --poses odometry.txt --intrinsics K.txt --json
  octosurf localize maps/office more --guess                      their poses are in the map, up to 30 cm and 5° off
  octosurf localize maps/office more --reach 3 --turn 180

Without --guess poses need only be right against each other, about the same vertical: the first scans tell where in
the map they were taken, if one place fits, and no other nearly as well. A camera must turn by 180° for that. Then
scans are treated one by one: first the scan's planes are matched with the map's surfaces, then its readings. One
line per scan: the error of the guess; how many of the six directions the surfaces in view determine (along the
others the guess stays), and how precisely; and how much of the scan they explain. A scan that fits nowhere within
reach, or equally well in several places, or that the map contradicts where it fits, is reported as unexplained and
keeps its guess; the exit code is then 1.
)";

struct LocalizeOptions {
  std::string map, write_poses;
  std::vector<std::string> scans;
  ScanSourceOptions source;
  ScanRange range;
  double reach_m = 0.3, turn_deg = 5;
  bool guess = false, no_up = false, json = false, force = false;
};

/// A little motion's length and angle; the covariance's, of the worst direction that is determined.
struct Localized {
  std::string name;
  Alignment alignment;
  std::string_view outcome;
  double moved_m = 0, turned_deg = 0, std_m = 0;
};

Localized found_in(const Scan& scan, const Alignment& alignment) {
  const auto outcome = static_cast<std::size_t>(alignment.outcome);
  Localized found{scan.name, alignment, alignment_outcome_names[outcome]};
  found.moved_m = (alignment.T_map_sensor.translation() - scan.T_map_sensor.translation()).norm();
  const Eigen::AngleAxisd turn(alignment.T_map_sensor.linear() * scan.T_map_sensor.linear().transpose());
  found.turned_deg = turn.angle() * deg_per_rad;
  Twist in_metres;
  in_metres << Eigen::Vector3d::Constant(alignment.lever_m), Eigen::Vector3d::Ones();
  for (int i = 0; i < alignment.determined; ++i) {
    const Twist along = in_metres.asDiagonal() * alignment.directions.col(i);
    found.std_m = std::max(found.std_m, std::sqrt(along.dot(alignment.covariance * along)));
  }
  return found;
}

void print_line(const Localized& found) {
  const Alignment& a = found.alignment;
  const bool is_found = a.outcome == AlignmentOutcome::corrected;
  std::printf("%s: %s", found.name.c_str(), is_found ? "found" : std::string(found.outcome).c_str());
  if (is_found)
    std::printf(", %.1f cm and %.2f° from the guess, %d of 6 directions fixed to %.1f mm",
                100 * found.moved_m, found.turned_deg, a.determined, 1e3 * found.std_m);
  std::printf(", %.0f %% of %zu known readings explained", 100 * a.explained_share(), a.known);
  if (a.contradicted > 0) std::printf(", %.1f %% of all contradict the map", 100 * a.contradicted);
  std::printf("\n");
}

nlohmann::ordered_json json_of(const Localized& found) {
  const Alignment& a = found.alignment;
  const Eigen::Quaterniond q(a.T_map_sensor.linear());
  std::vector<double> covariance(a.covariance.data(), a.covariance.data() + a.covariance.size());
  return {{"name", found.name},
          {"outcome", found.outcome},
          {"position", Eigen::Vector3d(a.T_map_sensor.translation())},
          {"quaternion", q.coeffs()},
          {"moved_m", found.moved_m},
          {"turned_deg", found.turned_deg},
          {"determined", a.determined},
          {"covariance", covariance},
          {"known", a.known},
          {"explained", a.explained},
          {"contradicted", a.contradicted}};
}

void run_localize(const LocalizeOptions& options) {
  if (!options.write_poses.empty()) {
    require_apart("--write-poses", options.write_poses, files_of_map(options.map));
    require_apart("--write-poses", options.write_poses, options.scans);
  }
  const LoadedMap loaded = open_map(options.map);
  Localizer localizer(loaded.map, {options.reach_m, options.turn_deg * rad_per_deg});
  ScanSourceOptions source_options = options.source;
  source_options.origin = loaded.map.origin();
  const auto open = [&] { return open_scans({options.scans.begin(), options.scans.end()}, source_options); };
  PoseLog poses(options.write_poses, options.force, loaded.map.origin());
  ScanRange range = options.range;
  if (!options.guess)
    range.T_map_poses =
        locate(loaded.map, options.map, ScanFeed(open(), options.range), !options.no_up, !options.json);
  auto source = open();
  for (const std::string& note : source->notes()) std::fprintf(stderr, "%s\n", note.c_str());
  ScanFeed feed(std::move(source), range);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  std::size_t scans = 0, unexplained = 0;
  while (const std::optional<Scan> scan = feed.next()) {
    const Localized found = found_in(*scan, localizer(*scan));
    poses.add(scan->stamp_s, found.alignment.T_map_sensor);
    ++scans;
    unexplained += found.alignment.outcome == AlignmentOutcome::corrected ? 0 : 1;
    if (options.json)
      json.push_back(json_of(found));
    else
      print_line(found);
  }
  poses.save(Saving::end);
  if (options.json)  // file names may be invalid UTF-8; the bytes in question are replaced
    std::printf("%s\n", json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
  if (unexplained > 0)
    throw Error(Error::Kind::data, "",
                std::to_string(unexplained) + " of " + std::to_string(scans) + " scans were not found",
                "a guess nearer by, or --reach and --turn, may help");
}

}  // namespace

void add_localize(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("localize", localize_description);
  const auto options = std::make_shared<LocalizeOptions>();
  verb->add_option("map", options->map, "finished map")->required();
  verb->add_option("scans", options->scans, "folders or files")->required();
  verb->add_option("--write-poses", options->write_poses,
                   "write the poses (stamp tx ty tz qx qy qz qw); a scan that is not found keeps its guess")
      ->type_name("FILE");
  verb->add_flag("--guess", options->guess, "their poses are guesses in the map's frame");
  verb->add_flag("--no-up", options->no_up, "their frame may be tilted; a level plane says how")
      ->excludes("--guess");
  const auto is_guess = [options](const std::string&) { options->guess = true; };
  verb->add_option("--reach", options->reach_m, "largest error of a guess, m; says that they are guesses")
      ->each(is_guess)
      ->capture_default_str();
  verb->add_option("--turn", options->turn_deg,
                   "likewise of its rotation, degrees, at most 180; more than 20 about the vertical only")
      ->each(is_guess)
      ->capture_default_str();
  verb->add_flag("--json", options->json, "one array for programs");
  verb->add_flag("--force", options->force, "overwrite the file of poses");
  add_scan_options(*verb, options->source, options->range);
  verb->callback([options] { run_localize(*options); });
}

}  // namespace octosurf
