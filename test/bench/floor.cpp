// A floor that grows: what a scan costs at its end beside what it costs at its beginning.
#include "bench/support.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <optional>
#include <random>
#include <string>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  double length = 500, width = 3, step = 0.5, resolution = 0.02;
  double noise = 0.002;  // m, of readings
  double stretch = 25;   // m, measured at either end
  std::uint64_t seed = 1;
};

/// What a camera 1.2 m above the floor sees of 3 m of it: a reading each centimetre or so.
Scan look_down(double x, const Options& options, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, options.noise);
  std::uniform_real_distribution<double> within(-0.005, 0.005);
  Scan scan;
  scan.T_map_sensor = Eigen::Translation3d(x, 0, 1.2);
  scan.stamp_s = x / options.step / 30;
  for (double along = 0.3; along < 3.3; along += 0.01)
    for (double across = -options.width / 2; across < options.width / 2; across += 0.01)
      scan.points.emplace_back(Eigen::Vector3f(static_cast<float>(along + within(random)),
                                               static_cast<float>(across + within(random)),
                                               static_cast<float>(-1.2 + noise(random))));
  return scan;
}

/// A mapper that walks along the floor.
struct Walk {
  explicit Walk(const Options& of, std::uint64_t seed) : options(of), random(seed) {
    Parameters parameters;
    parameters.occupancy.resolution = options.resolution;
    mapper.emplace(parameters);
  }
  ScanReport go_on() {
    const Scan scan = look_down(x, options, random);
    x += options.step;
    return mapper->insert(scan);
  }
  const Options& options;
  std::mt19937_64 random;
  std::optional<Mapper> mapper;
  double x = 0;
};

/// Milliseconds of scans, by stage, and of whole scans at the end.
struct Times {
  std::array<std::vector<double>, stage_names.size() + 1> ms;
  void add(const ScanReport& report) {
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage)
      ms[stage].push_back(report.stage_ms[stage]);
    ms.back().push_back(report.total_ms);
  }
};

/// Scans at the end by turns with scans at the beginning, so that the machine's other load hits both alike.
void measure(const Options& options) {
  Walk late(options, options.seed), early(options, options.seed);
  while (late.x < options.length - options.stretch) late.go_on();
  while (early.x < options.stretch) early.go_on();
  Times at_end, at_beginning;
  for (bool early_first = true; late.x < options.length; early_first = !early_first) {
    if (early_first) at_beginning.add(early.go_on());
    at_end.add(late.go_on());
    if (!early_first) at_beginning.add(early.go_on());
  }
  TextTable table({"median of a scan, ms", "at " + fixed(options.stretch, 0) + " m",
                   "at " + fixed(options.length, 0) + " m", "ratio"});
  for (std::size_t stage = 0; stage < at_end.ms.size(); ++stage) {
    const double before = percentile(at_beginning.ms[stage], 0.5), after = percentile(at_end.ms[stage], 0.5);
    const bool whole = stage == stage_names.size();
    if (whole) table.rule();
    table.add({whole ? "whole scan" : std::string(stage_names[stage]), fixed(before, 2), fixed(after, 2),
               fixed(after / before, 3)});
  }
  const Snapshot& snapshot = *late.mapper->snapshot();
  std::size_t vertices = 0;
  for (const SurfacePtr& surface : snapshot.surfaces) vertices += surface->boundary.size();
  std::printf("A floor %.0f m long and %.1f m wide at %.3f m, one thread, %zu scans each, by turns\n%s",
              options.length, options.width, options.resolution, at_end.ms.back().size(),
              table.text().c_str());
  std::printf("At the end %zu surfaces with %zu vertices.\n", snapshot.surfaces.size(), vertices);
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"What a scan costs while a floor grows: at its end as at its beginning?"};
  app.add_option("--length", options.length, "m")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--width", options.width, "m")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--resolution", options.resolution, "m")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--seed", options.seed, "of the readings")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    octosurf::bench::measure(options);
  } catch (const octosurf::Error& error) {
    std::fprintf(stderr, "bench_floor: %s\n", error.what());
    return 1;
  }
}
