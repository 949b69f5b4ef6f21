// How fast, how exact and how large, beside OctoMap, PCL and CGAL: one Google Benchmark per row.

#include "bench/speed/contest.hpp"
#include "bench/speed/row.hpp"
#include "bench/support.hpp"

#include <CGAL/version.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <benchmark/benchmark.h>
#include <cstdio>
#include <fstream>
#include <pcl/pcl_config.h>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

struct Group {
  const char* name;
  void (*add)(const SpeedOptions&);
  const char* help;
};

constexpr Group groups[] = {
    {"occupancy", add_occupancy_rows, "OccupancyMap::insert beside OctoMap's insertion"},
    {"plain", add_plain_rows, "insert_point_cloud for a plain octomap::OcTree, likewise"},
    {"lidar", add_lidar_rows, "the same with a real and a simulated lidar"},
    {"mapper", add_mapper_rows, "Mapper::insert beside OctoMap's insertion alone"},
    {"pcl", add_pcl_rows, "Mapper::insert beside the paper's pipeline from PCL"},
    {"memory", add_memory_rows, "heap per octree leaf beside OctoMap's"},
    {"loading", add_loading_rows, "load_map beside readBinary and mapping anew"},
    {"planes", add_planes_rows, "planes of a frame and of many beside CGAL's"},
    {"normals", add_normals_rows, "normals beside PCL's moving least squares"},
    {"derive", add_derive_rows, "a large surface that grows, beside from scratch"},
    {"long_run", add_long_run_rows, "ten laps of a corridor"},
    {"app", add_app_rows, "octosurf map on the kitchen's files, also in real time"}};

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(line.find(": ") + 2);
  return "unknown";
}

/// To the JSON and on the terminal. Google Benchmark's own context would also say that Debian built it
/// without NDEBUG, which is of no account here: contestants take their own time.
void note_conditions(const SpeedOptions& options, const std::string& commit) {
  const std::pair<const char*, std::string> conditions[] = {
      {"cpu_model", cpu_model()},
      {"cores", std::to_string(benchmark::CPUInfo::Get().num_cpus)},
      {"compiler", "g++ " __VERSION__ ", " OCTOSURF_BUILD_TYPE},
      {"octomap", OCTOMAP_VERSION_TEXT},
      {"pcl", PCL_VERSION_PRETTY},
      {"cgal", CGAL_VERSION_STR},
      {"google_benchmark", BENCHMARK_VERSION_TEXT},
      {"form", options.frames  ? "--frames " + std::to_string(*options.frames)
               : options.brief ? "short form"
                               : "full form"},
      {"commit", commit}};
  for (const auto& [name, value] : conditions) {
    benchmark::AddCustomContext(name, value);
    std::printf("%-17s %s\n", name, value.c_str());
  }
}

void run(const SpeedOptions& options, const std::vector<std::string>& names, const std::string& json,
         const std::string& filter, const std::string& commit) {
  for (const Group& group : groups)
    if (names.empty() || std::find(names.begin(), names.end(), group.name) != names.end()) group.add(options);
  note_conditions(options, commit);
  std::vector<std::string> arguments{"bench_speed"};
  if (!json.empty()) {
    arguments.push_back("--benchmark_out=" + json);
    arguments.emplace_back("--benchmark_out_format=json");
  }
  if (!filter.empty()) arguments.push_back("--benchmark_filter=" + filter);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  int argc = static_cast<int>(argv.size());
  benchmark::Initialize(&argc, argv.data());
  RowReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  using namespace octosurf::bench;
  if (serve_contestant(argc, argv)) return 0;
  SpeedOptions options;
  options.resolutions = {0.02, 0.01};
  options.threads = {1};
  std::vector<std::string> names;
  std::string json, filter, commit = "unknown";
  CLI::App app{"speed, memory and accuracy beside OctoMap, PCL and CGAL, on the same data in the same run"};
  std::string help = "of the groups:";
  std::vector<std::string> known;
  for (const Group& group : groups) {
    help += std::string("\n  ") + group.name + ": " + group.help;
    known.emplace_back(group.name);
  }
  app.add_option("group", names, help)->check(CLI::IsMember(known));
  app.add_flag("--short", options.brief, "few frames each");
  app.add_option("--frames", options.frames, "scans a row, instead of the row's own number");
  app.add_option("--every", options.every, "take every k-th of the kitchen's frames")
      ->check(CLI::PositiveNumber);
  app.add_option("--resolution", options.resolutions, "of the kitchen's rows, m")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--threads", options.threads, "of the occupancy rows, a row each")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--input", options.input, "a depth recording in the place of ../shared/data's kitchen");
  app.add_option("--filter", filter, "only rows whose name matches this regular expression");
  app.add_option("--json", json, "write the numbers there");
  app.add_option("--commit", commit, "what was measured, noted in the JSON");
  CLI11_PARSE(app, argc, argv);
  return guarded_main([&] { run(options, names, json, filter, commit); });
}
