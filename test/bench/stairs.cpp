// Stairs of every kind, by sensor: how many are found with the right count, and how far their measures are
// off.
#include "evaluation/stairs.hpp"

#include "bench/support.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>

#include <octosurf/mapper.hpp>
#include <octosurf/up.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> kinds{"flight", "landing", "spiral", "open"};
  std::vector<std::string> sensors{"depth", "depth-real", "spinning", "tilting"};
  std::size_t seeds = 3;
  std::uint64_t first_seed = 1;
};

struct Row {
  std::size_t all = 0, seen = 0, right = 0, kind = 0, invented = 0;
  std::vector<double> riser_mm, tread_mm, width_mm, heading_deg;

  void add(const evaluation::StairScores& scores) {
    invented += scores.invented;
    for (const evaluation::StairScore& stair : scores.stairs) {
      ++all;
      if (!stair.wholly_seen()) continue;
      ++seen;
      if (!stair.right_count()) continue;
      ++right;
      kind += stair.right_kind ? 1 : 0;
      riser_mm.push_back(1e3 * std::fabs(stair.riser_m));
      tread_mm.push_back(1e3 * std::fabs(stair.tread_m));
      width_mm.push_back(1e3 * std::fabs(stair.width_m));
      heading_deg.push_back(180 / std::numbers::pi * std::fabs(stair.heading_rad));
    }
  }
  std::vector<std::string> cells(const std::string& name) const {
    const auto count = [](std::size_t n) { return std::to_string(n); };
    return {name,
            count(all),
            count(seen),
            count(right),
            count(kind),
            fixed(percentile(riser_mm, 1), 1),
            fixed(percentile(tread_mm, 1), 1),
            fixed(percentile(width_mm, 1), 0),
            fixed(percentile(heading_deg, 1), 2),
            count(invented)};
  }
};

evaluation::StairScores score(const simulation::SimulationOptions& options) {
  const Recorded recorded = record(options);
  Mapper mapper{Parameters{}};
  for (const Scan& scan : recorded.scans) mapper.insert(scan);
  const Eigen::Vector3d up = up_of(mapper.map()).direction;
  const evaluation::StairScores scores =
      evaluation::evaluate_stairs(find_stairs(*mapper.snapshot(), up).stairs, recorded.truth, up);
  for (const evaluation::StairScore& stair : scores.stairs)
    if (stair.wholly_seen() && !stair.right_count())
      std::printf("%s %s seed %zu: %zu of %zu steps, in %zu pieces\n", options.scene.c_str(),
                  options.sensor.c_str(), static_cast<std::size_t>(options.seed), stair.found, stair.steps,
                  stair.pieces);
  return scores;
}

void body(const Options& options) {
  TextTable table({"", "stairs", "wholly seen", "right count", "right course", "riser mm", "tread mm",
                   "width mm", "heading °", "invented"});
  for (const std::string& sensor : options.sensors) {
    table.rule();
    for (const std::string& kind : options.kinds) {
      Row row;
      for (std::size_t k = 0; k < options.seeds; ++k) {
        simulation::SimulationOptions simulation;
        simulation.sensor = sensor;
        simulation.seed = options.first_seed + k;
        set_scene(kind, simulation);
        row.add(score(simulation));
      }
      table.add(row.cells(sensor + ", " + kind));
    }
  }
  std::printf(
      "Of the wholly seen, those found as one stair with as many steps; of these the course and the "
      "greatest errors of the means.\n%s",
      table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"stairs found on maps of simulated stairs, against the truth"};
  app.add_option("--kinds", options.kinds, "scenes")->delimiter(',')->capture_default_str();
  app.add_option("--sensors", options.sensors)->delimiter(',')->capture_default_str();
  app.add_option("--seeds", options.seeds, "recordings of each")->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
