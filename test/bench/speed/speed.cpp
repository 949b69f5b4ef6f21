// How fast and how large, beside OctoMap, on Google Benchmark.

#include "bench/speed/speed.hpp"

#include "bench/support.hpp"
#include "simulation/recording.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <malloc.h>
#include <map>

#include <octosurf/error.hpp>

namespace octosurf::bench {

benchmark::internal::Benchmark* add(const std::string& name, const std::string& label, std::size_t iterations,
                                    const std::function<void(benchmark::State&)>& body) {
  const auto guarded = [label, body](benchmark::State& state) {
    state.SetLabel(label);
    try {
      body(state);
    } catch (const std::exception& error) {
      state.SkipWithError(error.what());
    }
  };
  return benchmark::RegisterBenchmark(name.c_str(), guarded)
      ->Iterations(static_cast<benchmark::IterationCount>(iterations))
      ->Unit(benchmark::kMillisecond);
}

Parameters parameters_at(double resolution, double max_range) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  if (std::isfinite(max_range)) parameters.occupancy.max_range = max_range;
  return parameters;
}

double as_counter(std::uint64_t digest) {
  return static_cast<double>(digest & ((std::uint64_t{1} << 48) - 1));
}

double heap_in_use() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

namespace {

Scans read(const char* folder, std::size_t count) {
  const std::filesystem::path path = std::filesystem::path(OCTOSURF_DATA_DIR) / folder;
  if (!std::filesystem::is_directory(path)) throw Error(Error::Kind::data, path.string(), "is missing");
  Scans scans;
  for_each_scan(path, 1, count, [&](const Scan& scan, double) { scans.push_back(scan); });
  return scans;
}

}  // namespace

const Scans& kitchen_scans(std::size_t count) {
  static std::map<std::size_t, Scans> kept;
  Scans& scans = kept[count];
  if (scans.empty()) scans = read("rgbd_7scenes_redkitchen", count);
  return scans;
}

const Scans& hall_scans(std::size_t count) {
  static const Scans scans = read("lidar_balm_realworld", count);
  return scans;
}

const Scans& office_scans(std::size_t count) {
  static const Scans scans = [count] {
    simulation::SimulationOptions options;
    options.scene = "office";
    options.sensor = "spinning";
    const simulation::Recording recording(options);
    Scans first;
    for (std::size_t i = 0; i < std::min(count, recording.size()); ++i) first.push_back(recording.scan(i));
    return first;
  }();
  return scans;
}

std::string key(char letter, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%c:%g", letter, value);
  return text;
}

std::string centimetres(double metres) { return key(' ', metres * 100).substr(2) + " cm"; }

const std::filesystem::path& scratch_folder() {
  struct Folder {
    std::filesystem::path path;
    Folder() {
      std::string pattern = (std::filesystem::temp_directory_path() / "octosurf-bench-XXXXXX").string();
      if (mkdtemp(pattern.data()) == nullptr)
        throw Error(Error::Kind::output, pattern, "cannot be created", "set TMPDIR");
      path = pattern;
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  return folder.path;
}

namespace {

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(": ") + 2);
  return "unknown";
}

/// Google Benchmark's arguments, and `--short`: few scans each. Repetitions of all benchmarks are mixed at
/// random, so that whatever else the machine does hits both sides alike.
void run(std::vector<std::string> arguments) {
  const bool brief = std::erase(arguments, "--short") > 0;
  arguments.insert(arguments.begin() + 1,
                   {"--benchmark_repetitions=3", "--benchmark_enable_random_interleaving=true"});
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  int argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());
  if (benchmark::ReportUnrecognizedArguments(argc, argv.data()))
    throw Error(Error::Kind::usage, argv[1], "is unknown",
                "--help lists Google Benchmark's; --short: few scans");
  for (const auto& [name, value] : {std::pair{"cpu_model", cpu_model()},
                                    {"compiler", "g++ " __VERSION__ ", " OCTOSURF_BUILD_TYPE},
                                    {"octomap", OCTOMAP_VERSION_TEXT},
                                    {"form", brief ? "short form" : "full form"}})
    benchmark::AddCustomContext(name, value);
  for (const auto add_group : {add_insertion, add_whole_runs}) add_group(brief);
  if (benchmark::RunSpecifiedBenchmarks() == 0)
    throw Error(Error::Kind::usage, "--benchmark_filter", "matches none");
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  return octosurf::bench::guarded_main([&] { octosurf::bench::run({argv, argv + argc}); });
}
