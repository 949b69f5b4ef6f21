// How well poses that drift are corrected: per recording the errors of the poses, given and used, against the
// truth, and how well the covariances say so.

#include "alignment/pose_fit.hpp"
#include "alignment/sensor_error.hpp"
#include "bench/support.hpp"
#include "evaluation/evaluate.hpp"
#include "simulation/recording.hpp"
#include "surfaces/map_state.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <optional>
#include <random>

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> scenes{"room", "office", "stairs", "stones"};
  std::vector<std::uint64_t> seeds{1, 2, 3};
  std::string sensor = "depth";
  double resolution = 0.02;
  double drift_m = 0.015, drift_deg = 0.3;
  double tilt_deg = 0, scale = 1;  // of the sensor, about its x
  int laps = 2;
  std::optional<std::size_t> frames;
  std::size_t every = 1;       // scan of the recording
  double length = 60;          // m, of the corridor
  std::size_t jump_every = 0;  // this scan's pose is off by 20 cm and 3°
  bool verbose = false, localize = false;
};

constexpr double deg = 180 / std::numbers::pi;

/// Off by 20 cm and 3°, in a direction and about an axis that change from scan to scan.
Eigen::Isometry3d jumped(const Eigen::Isometry3d& T, std::size_t i) {
  const auto where = static_cast<double>(i);
  Twist twist;
  twist << 3 / deg * Eigen::Vector3d(std::sin(3 * where), std::cos(5 * where), std::sin(where)).normalized(),
      0.2 * Eigen::Vector3d(std::cos(where), std::sin(where), std::sin(7 * where)).normalized();
  return alignment::moved(T, twist);
}

/// A recording's poses, as they came and as they were used, and what was said of them.
struct Poses {
  std::vector<double> given_mm, given_deg, used_mm, used_deg, align_ms;
  std::vector<double> open_mm;     ///< moved along what the scan does not determine; of those that leave such
  double fit_mm = 0, fit_deg = 0;  ///< error of the last scan's fit, along all directions
  double squared = 0;              ///< of the determined errors, in their standard deviations
  int dimensions = 0;
  std::array<std::size_t, alignment_outcome_names.size()> outcomes{};

  void add(const Scan& scan, const Eigen::Isometry3d& truth, const ScanReport& report) {
    const Alignment& alignment = report.alignment;
    const Twist given = alignment::twist_between(truth, scan.T_map_sensor);
    const Twist used = alignment::twist_between(truth, alignment.T_map_sensor);
    given_mm.push_back(1e3 * given.tail<3>().norm());
    given_deg.push_back(deg * given.head<3>().norm());
    used_mm.push_back(1e3 * used.tail<3>().norm());
    used_deg.push_back(deg * used.head<3>().norm());
    align_ms.push_back(report.stage_ms[static_cast<std::size_t>(Stage::align)]);
    ++outcomes[static_cast<std::size_t>(alignment.outcome)];
    Twist all = alignment::twist_between(scan.T_map_sensor, alignment.T_map_sensor);
    const double along_determined = alignment.determined_length_m(all);
    all.head<3>() *= alignment.lever_m;
    if (alignment.determined < 6)
      open_mm.push_back(1e3 * std::sqrt(std::max(0.0, all.squaredNorm() - std::pow(along_determined, 2))));
    const Twist fit =
        alignment::twist_between(truth, alignment::moved(scan.T_map_sensor, alignment.disagreement));
    fit_mm = 1e3 * fit.tail<3>().norm();
    fit_deg = deg * fit.head<3>().norm();
    if (alignment.determined == 0) return;
    Twist in_metres;
    in_metres << Eigen::Vector3d::Constant(alignment.lever_m), Eigen::Vector3d::Ones();
    const Eigen::MatrixXd along =
        alignment.directions.leftCols(alignment.determined).transpose() * in_metres.asDiagonal();
    const Eigen::VectorXd error = along * fit;
    squared += error.dot((along * alignment.covariance * along.transpose()).ldlt().solve(error));
    dimensions += alignment.determined;
  }

  void print(std::size_t i, const Alignment& alignment) const {
    std::printf(
        "%4zu %s: given %.2f mm %.3f°, used %.2f mm %.3f°, fit %.2f mm %.3f° (%d determined, %zu of %zu)\n",
        i, alignment_outcome_names[static_cast<std::size_t>(alignment.outcome)].data(), given_mm.back(),
        given_deg.back(), used_mm.back(), used_deg.back(), fit_mm, fit_deg, alignment.determined,
        alignment.explained, alignment.known);
  }
};

double mean(const std::vector<double>& values) { return sum(values) / static_cast<double>(values.size()); }

std::vector<std::string> row_of(const std::string& name, const evaluation::Evaluation& e,
                                const std::vector<double>& mm, const std::vector<double>& degrees,
                                double ms) {
  return {name,
          std::to_string(e.correct) + "/" + std::to_string(e.faces),
          std::to_string(e.noise),
          fixed(100 * e.coverage, 1),
          fixed(100 * e.unsafe_share, 2),
          fixed(e.normal_rad.mean * deg, 2),
          fixed(1e3 * e.offset_m.mean, 2),
          fixed(mean(mm), 2),
          fixed(percentile(mm, 0.95), 2),
          fixed(mean(degrees), 3),
          fixed(ms, 1)};
}

/// A sensor that is tilted and whose readings are too long.
void err(const Options& options, Scan& scan) {
  if (options.tilt_deg == 0 && options.scale == 1) return;
  const Eigen::AngleAxisf tilt(static_cast<float>(options.tilt_deg / deg), Eigen::Vector3f::UnitX());
  for (Eigen::Vector3f& point : scan.points) point = static_cast<float>(options.scale) * (tilt * point);
}

void run(const Options& options, const std::string& scene, std::uint64_t seed, TextTable& table) {
  simulation::SimulationOptions simulation;
  set_scene(scene, simulation);
  simulation.sensor = options.sensor;
  simulation.seed = seed;
  simulation.drift_m = options.drift_m;
  simulation.drift_rad = options.drift_deg / deg;
  simulation.laps = options.laps;
  simulation.frames = options.frames;
  simulation.length = options.length;
  const simulation::Recording recording(simulation);
  simulation::Recording::Visibility visibility = recording.visibility();
  Parameters on, off;
  on.occupancy.resolution = off.occupancy.resolution = options.resolution;
  off.alignment.enabled = false;
  Mapper with(on), without(off);
  Poses poses;
  double with_ms = 0, without_ms = 0;
  for (std::size_t i = 0; i < recording.size(); i += options.every) {
    const simulation::Readings ideal = recording.ideal(i);
    visibility.add(i, ideal);
    Scan scan = recording.labelled_scan(i, ideal).scan;
    err(options, scan);
    if (options.jump_every > 0 && (i + 1) % options.jump_every == 0)
      scan.T_map_sensor = jumped(scan.T_map_sensor, i);
    const ScanReport report = with.insert(scan);
    with_ms += report.total_ms;
    without_ms += without.insert(scan).total_ms;
    poses.add(scan, recording.true_pose(i), report);
    if (options.verbose) poses.print(i, report.alignment);
  }
  const evaluation::Truth truth = visibility.truth();
  const std::string name = std::filesystem::path(scene).stem().string() + " " + std::to_string(seed);
  const auto scans = static_cast<double>(poses.given_mm.size());
  table.add(row_of(name + " off", evaluation::evaluate(*without.snapshot(), truth), poses.given_mm,
                   poses.given_deg, without_ms / scans));
  table.add(row_of(name + " auto", evaluation::evaluate(*with.snapshot(), truth), poses.used_mm,
                   poses.used_deg, with_ms / scans));
  std::fprintf(stderr, "%s: alignment %.2f ms a scan, 95 %% within %.2f; squared error per dimension %.2f;",
               name.c_str(), mean(poses.align_ms), percentile(poses.align_ms, 0.95),
               poses.squared / std::max(1, poses.dimensions));
  if (!poses.open_mm.empty())
    std::fprintf(stderr, " %zu scans leave directions open, moved along these by %.2f mm, 95 %% within %.2f;",
                 poses.open_mm.size(), mean(poses.open_mm), percentile(poses.open_mm, 0.95));
  if (const auto error = alignment::sensor_error_of(with.map().state().alignment)) {
    const Eigen::Vector3d tilt = deg * error->tilt_rad();
    std::fprintf(
        stderr, " sensor tilted by %.2f %.2f %.2f° (± %.2f %.2f %.2f), readings longer by %.4f (± %.4f);",
        tilt.x(), tilt.y(), tilt.z(), deg * error->tilt_deviation_rad(0), deg * error->tilt_deviation_rad(1),
        deg * error->tilt_deviation_rad(2), error->range_scale(), error->range_scale_deviation());
  }
  for (std::size_t o = 0; o < poses.outcomes.size(); ++o)
    if (poses.outcomes[o] > 0)
      std::fprintf(stderr, " %s %zu", alignment_outcome_names[o].data(), poses.outcomes[o]);
  std::fprintf(stderr, "\n");
}

/// Scans of a second recording of the scene, from guesses up to 30 cm and 5° off, in the map of the first.
void localize(const Options& options, const std::string& scene, std::uint64_t seed, TextTable& table) {
  simulation::SimulationOptions simulation;
  set_scene(scene, simulation);
  simulation.sensor = options.sensor;
  simulation.seed = seed;
  const simulation::Recording recording(simulation);
  Parameters parameters;
  parameters.occupancy.resolution = options.resolution;
  Mapper mapper(parameters);
  for (std::size_t i = 0; i < recording.size(); ++i) mapper.insert(recording.scan(i));
  mapper.drain();
  Localizer localizer(mapper.snapshot());
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto direction = [&] {
    Eigen::Vector3d v;
    do v = Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng));
    while (v.norm() > 1 || v.norm() < 0.1);
    return Eigen::Vector3d(v.normalized());
  };
  std::vector<double> mm, degs, ms;
  std::size_t whole = 0, found = 0, wrong = 0;
  double nees = 0;
  int dims = 0;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    Scan scan = recording.scan(i);
    Twist off;
    off << 5 / deg * std::fabs(uniform(rng)) * direction(), 0.3 * std::fabs(uniform(rng)) * direction();
    const Eigen::Isometry3d truth = scan.T_map_sensor;
    scan.T_map_sensor = alignment::moved(truth, off);
    Alignment alignment;
    ms.push_back(time_ms([&] { alignment = localizer(scan); }));
    const Twist error = alignment::twist_between(truth, alignment.T_map_sensor);
    if (alignment.outcome == AlignmentOutcome::corrected && alignment.determined == 6) {
      nees += error.dot(alignment.covariance.inverse() * error);
      dims += 6;
    }
    const bool right =
        alignment.outcome == AlignmentOutcome::corrected && alignment.determined_length_m(error) < 0.02;
    whole += alignment.determined == 6;
    found += right;
    wrong += alignment.outcome == AlignmentOutcome::corrected && alignment.determined == 6 && !right;
    if (options.verbose && !right)
      std::printf(
          "%s %zu: %s, determined %d, known %zu, explained %.2f, off %.1f mm %.2f° -> %.1f mm %.2f°\n",
          scene.c_str(), i, alignment_outcome_names[static_cast<std::size_t>(alignment.outcome)].data(),
          alignment.determined, alignment.known, alignment.explained_share(), 1e3 * off.tail<3>().norm(),
          deg * off.head<3>().norm(), 1e3 * error.tail<3>().norm(), deg * error.head<3>().norm());
    if (!right || alignment.determined < 6) continue;
    mm.push_back(1e3 * error.tail<3>().norm());
    degs.push_back(deg * error.head<3>().norm());
  }
  table.add({scene + " " + std::to_string(seed), std::to_string(recording.size()), std::to_string(whole),
             std::to_string(found), std::to_string(wrong), fixed(percentile(mm, 0.5), 2),
             fixed(percentile(mm, 0.95), 2), fixed(percentile(degs, 0.5), 3),
             fixed(percentile(degs, 0.95), 3), fixed(nees / dims, 2), fixed(percentile(ms, 0.5), 1),
             fixed(percentile(ms, 0.95), 1)});
}

void body(const Options& options) {
  if (options.localize) {
    TextTable table({"recording", "scans", "determined", "found", "wrong", "mm p50", "p95", "° p50", "p95",
                     "NEES/6", "ms p50", "p95"});
    for (const std::string& scene : options.scenes)
      for (const std::uint64_t seed : options.seeds) localize(options, scene, seed, table);
    std::printf("%s", table.text().c_str());
    return;
  }
  TextTable table({"recording", "correct", "noise", "coverage %", "unsafe %", "normal °", "offset mm",
                   "pose mm", "p95", "pose °", "ms/scan"});
  for (const std::string& scene : options.scenes)
    for (const std::uint64_t seed : options.seeds) run(options, scene, seed, table);
  std::printf("%s", table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"poses corrected by the surfaces, on simulated scenes"};
  app.add_option("--scenes", options.scenes, "names, or files of meshes")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--seeds", options.seeds)->capture_default_str();
  app.add_option("--sensor", options.sensor)->capture_default_str();
  app.add_option("--resolution", options.resolution)->capture_default_str();
  app.add_option("--drift-m", options.drift_m, "per lap")->capture_default_str();
  app.add_option("--drift-deg", options.drift_deg, "per lap")->capture_default_str();
  app.add_option("--tilt-deg", options.tilt_deg, "of the sensor against its poses, about its x");
  app.add_option("--scale", options.scale, "on all readings")->capture_default_str();
  app.add_option("--laps", options.laps)->capture_default_str();
  app.add_option("--frames", options.frames, "scans");
  app.add_option("--every", options.every, "k-th scan only")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--length", options.length, "of the scene corridor, m")->capture_default_str();
  app.add_option("--jump-every", options.jump_every, "every so many scans one is off by 20 cm and 3 degrees");
  app.add_flag("--localize", options.localize,
               "scans in a finished map, from guesses up to 30 cm and 5 degrees off");
  app.add_flag("--verbose", options.verbose);
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
