// A corridor walked again and again: what a lap costs late and early, and what the map has grown to.

#include "bench/speed/row.hpp"
#include "bench/support.hpp"
#include "simulation/recording.hpp"
#include "simulation/sensor.hpp"

namespace octosurf::bench {
namespace {

constexpr int laps = 10;
constexpr std::size_t thinning = 3;  // every third row and column: 17 mm between pixels at 3 m

Scan thinned_scan(const simulation::Recording& recording, std::size_t i) {
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

/// One mapper walks ten laps, another two: its second lap by turns with the first one's tenth, so that
/// the machine's other load hits both laps alike.
Numbers long_run_numbers(double length, std::size_t scans_per_lap) {
  simulation::SimulationOptions simulation;
  simulation.scene = "corridor";
  simulation.length = length;
  simulation.laps = laps;
  simulation.frames = scans_per_lap * laps;
  const simulation::Recording recording(simulation);
  Contest contest;
  const Json settings{{"resolution", 0.02}, {"max_range", 4}};
  contest.enter("late", "mapper", settings);
  contest.enter("early", "mapper", settings);
  const auto insert = [&](const std::string& name, std::size_t i) {
    contest.prepare(name, thinned_scan(recording, i));
    contest.run(name);
  };
  for (std::size_t i = 0; i < scans_per_lap * (laps - 1); ++i) insert("late", i);
  for (std::size_t i = 0; i < scans_per_lap; ++i) insert("early", i);
  for (std::size_t i = 0; i < scans_per_lap; ++i) {
    const bool early_first = i % 2 == 0;
    if (early_first) insert("early", scans_per_lap + i);
    insert("late", scans_per_lap * (laps - 1) + i);
    if (!early_first) insert("early", scans_per_lap + i);
  }
  const auto last_lap = [&](const std::string& name) {
    const std::vector<double> ms = milliseconds(contest.turns(name));
    return std::vector<double>(ms.end() - static_cast<std::ptrdiff_t>(scans_per_lap), ms.end());
  };
  const std::vector<double> late = last_lap("late"), early = last_lap("early");
  const Json late_map = contest.ask("late", {{"save", (scratch_folder() / "late").string()}});
  const Json early_map = contest.ask("early", {{"save", (scratch_folder() / "early").string()}});
  const auto ratio = [&](const char* what) {
    return late_map.at(what).get<double>() / early_map.at(what).get<double>();
  };
  return {{"scans", static_cast<double>(recording.size())},
          {"lap10_p50_ms", median(late)},
          {"lap2_p50_ms", median(early)},
          {"lap10_p99_ms", percentile(late, 0.99)},
          {"lap2_p99_ms", percentile(early, 0.99)},
          {"p50_lap10_over_lap2", median(late) / median(early)},
          {"p99_lap10_over_lap2", percentile(late, 0.99) / percentile(early, 0.99)},
          {"octree_lap10_over_lap2", ratio("tree_bytes")},
          {"heap_lap10_over_lap2", ratio("heap")},
          {"file_lap10_over_lap2", ratio("file_bytes")},
          {"lap10_heap_mb", late_map.at("heap").get<double>() / 1e6},
          {"lap10_surfaces", late_map.at("surfaces").get<double>()},
          {"lap2_surfaces", early_map.at("surfaces").get<double>()}};
}

}  // namespace

void add_long_run_rows(const SpeedOptions& options) {
  const double length = options.brief ? 6 : 20;
  const std::size_t per_lap = options.count(30, 520);
  register_row({"long_run/corridor",
                "simulated corridor walked ten times, " + std::to_string(per_lap * laps) + " scans, 2 cm",
                "its own second lap", [length, per_lap] { return long_run_numbers(length, per_lap); }});
}

}  // namespace octosurf::bench
