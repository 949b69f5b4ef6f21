// A corridor walked again and again, and the built command on the kitchen's files.

#include "bench/speed/speed.hpp"
#include "bench/support.hpp"
#include "simulation/recording.hpp"
#include "simulation/sensor.hpp"

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

using Json = nlohmann::json;

/// Every third row and column: 17 mm between pixels at 3 m.
Scan thinned_scan(const simulation::Recording& recording, std::size_t i) {
  constexpr std::size_t thinning = 3;
  const simulation::Readings readings = recording.measured(i, recording.ideal(i));
  const std::vector<Eigen::Vector3f>& rays = recording.rays();
  Scan scan;
  scan.T_map_sensor = recording.T_map_sensor(i);
  scan.stamp_s = recording.stamp_s(i);
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const std::size_t row = k / simulation::depth_width, column = k % simulation::depth_width;
    if (row % thinning == 0 && column % thinning == 0 && readings.t[k] > 0)
      scan.points.push_back(readings.t[k] * rays[k]);
  }
  return scan;
}

/// Counters of one walker: its last lap's scans, and what the map has grown to.
void count_lap(benchmark::State& state, const std::string& prefix, const Mapper& mapper,
               const std::vector<double>& ms) {
  const std::filesystem::path stem = scratch_folder() / prefix;
  save_map(mapper.map(), stem);
  state.counters[prefix + "p50_ms"] = percentile(ms, 0.5);
  state.counters[prefix + "p99_ms"] = percentile(ms, 0.99);
  state.counters[prefix + "tree_bytes"] = static_cast<double>(mapper.map().size().bytes);
  state.counters[prefix + "file_bytes"] =
      static_cast<double>(std::filesystem::file_size(stem.string() + ".surfaces"));
  state.counters[prefix + "surfaces"] = static_cast<double>(mapper.snapshot()->surfaces.size());
}

/// One mapper walks ten laps, another two: its second lap by turns with the first one's tenth, so that
/// the machine's other load hits both laps alike.
void long_run(benchmark::State& state, double length, std::size_t per_lap) {
  constexpr std::size_t laps = 10;
  simulation::SimulationOptions options;
  options.scene = "corridor";
  options.length = length;
  options.laps = laps;
  options.frames = per_lap * laps;
  const simulation::Recording recording(options);
  const double heap_at_start = heap_in_use();
  Mapper late(parameters_at(0.02), 1);
  for (std::size_t i = 0; i < per_lap * (laps - 1); ++i) late.insert(thinned_scan(recording, i));
  const double heap_late = heap_in_use();
  Mapper early(parameters_at(0.02), 1);
  for (std::size_t i = 0; i < per_lap; ++i) early.insert(thinned_scan(recording, i));
  const double heap_early = heap_in_use();
  std::vector<double> late_ms, early_ms;
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    const Scan early_scan = thinned_scan(recording, per_lap + i);
    const Scan late_scan = thinned_scan(recording, per_lap * (laps - 1) + i);
    const bool early_first = i++ % 2 == 0;
    if (early_first) early_ms.push_back(early.insert(early_scan).total_ms);
    late_ms.push_back(late.insert(late_scan).total_ms);
    if (!early_first) early_ms.push_back(early.insert(early_scan).total_ms);
    state.SetIterationTime(late_ms.back() / 1000);
  }
  count_lap(state, "lap10_", late, late_ms);
  count_lap(state, "lap2_", early, early_ms);
  state.counters["lap10_heap_bytes"] = heap_late - heap_at_start;  // at its beginning
  state.counters["lap2_heap_bytes"] = heap_early - heap_late;
}

/// The report of `octosurf map KITCHEN` with two threads; throws Error(data) with its last line if it fails.
Json report_of(double resolution, std::size_t scans, const std::string& more) {
  const std::string stem = (scratch_folder() / "app").string(), log = stem + ".log", report = stem + ".json";
  const std::string command = OCTOSURF_APP " map '" + kitchen().string() + "' -o " + stem + " --report " +
                              report + " --force --threads 2 --resolution " + std::to_string(resolution) +
                              " --first " + std::to_string(scans) + more + " > " + log + " 2>&1";
  if (std::system(command.c_str()) != 0) {
    std::ifstream in(log);
    std::string last;
    for (std::string line; std::getline(in, line);) last = line;
    throw Error(Error::Kind::data, OCTOSURF_APP, "failed: " + last);
  }
  std::ifstream in(report);
  return Json::parse(in);
}

double number(const Json& value) { return value.is_null() ? 0 : value.get<double>(); }

void throughput(benchmark::State& state, double resolution, std::size_t scans) {
  for ([[maybe_unused]] auto _ : state) {
    const Json report = report_of(resolution, scans, "");
    const double wall_s = number(report.at("wall_s")), done = number(report.at("scans"));
    state.SetIterationTime(wall_s);
    state.counters["scans"] = done;
    state.counters["frames_per_second"] = done / wall_s;
    state.counters["scan_p50_ms"] = number(report.at("scan_ms").at("p50"));
    state.counters["scan_p95_ms"] = number(report.at("scan_ms").at("p95"));
    state.counters["peak_rss_mb"] = number(report.at("peak_rss_mb"));
  }
}

void realtime(benchmark::State& state, double resolution, std::size_t scans) {
  for ([[maybe_unused]] auto _ : state) {
    const Json report = report_of(resolution, scans, " --realtime");
    const Json& lag = report.at("detection_lag_s");
    state.SetIterationTime(number(report.at("wall_s")));
    state.counters["scans"] = number(report.at("scans"));
    state.counters["skipped_scans"] = static_cast<double>(report.at("skipped_scans").size());
    state.counters["first_detection_ms"] = 1000 * number(report.at("time_to_first_detection_s"));
    for (const char* what : {"p50", "p95", "mean"})
      state.counters[std::string("lag_") + what + "_ms"] = 1000 * number(lag.at(what));
    state.counters["categorized_percent"] = number(report.at("categorized_percent"));
    // Table I, real-world complex: another place and sensor, eight cores.
    state.counters["theirs_first_detection_ms"] = resolution < 0.015 ? 1940 : 1410;
    state.counters["theirs_lag_mean_ms"] = resolution < 0.015 ? 3040 : 1590;
  }
}

}  // namespace

void add_whole_runs(bool brief) {
  const double length = brief ? 6 : 20;
  const std::size_t per_lap = brief ? 30 : 520, scans = brief ? 30 : 120;
  const auto once = [](const std::string& name, const std::string& label, std::size_t iterations, auto body) {
    add(name, label, iterations, body)->UseManualTime()->Repetitions(1);
  };
  once("long_run/corridor",
       "simulated corridor walked ten times, " + std::to_string(per_lap * 10) + " scans, 2 cm", per_lap,
       [=](benchmark::State& state) { long_run(state, length, per_lap); });
  for (const double d : {0.02, 0.01}) {
    const std::string kitchen = ", kitchen, " + centimetres(d) + ", two threads";
    once("app/" + key('d', d), "`octosurf map` from files to files" + kitchen, 1,
         [=](benchmark::State& state) { throughput(state, d, scans); });
    once("realtime/" + key('d', d), "`octosurf map --realtime` at 30 Hz" + kitchen, 1,
         [=](benchmark::State& state) { realtime(state, d, scans); });
  }
}

}  // namespace octosurf::bench
