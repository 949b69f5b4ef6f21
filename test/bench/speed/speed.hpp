#pragma once

#include <benchmark/benchmark.h>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <octosurf/mapper.hpp>
#include <octosurf/parameters.hpp>
#include <octosurf/scan.hpp>

/// Benchmarks named group/…/side: sides with the same path before their name do the same work on the
/// same scans, and table.py puts them side by side.
namespace octosurf::bench {

using Scans = std::vector<Scan>;

inline constexpr double camera_range = 4;  // m

/// Registers a benchmark of `iterations` iterations. An exception in `body` marks it as failed, with the
/// reason. `label`: what is done, or for the other side who does it.
benchmark::internal::Benchmark* add(const std::string& name, const std::string& label, std::size_t iterations,
                                    const std::function<void(benchmark::State&)>& body);

/// One iteration for each scan: `prepare` is not timed, `run` is.
template <class Prepare, class Run>
void for_each(benchmark::State& state, const Scans& scans, const Prepare& prepare, const Run& run) {
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    state.PauseTiming();
    const Scan& scan = scans.at(i++);
    prepare(scan);
    state.ResumeTiming();
    run(scan);
  }
}

/// Default parameters at `resolution`; an infinite `max_range` is unlimited.
Parameters parameters_at(double resolution, double max_range = camera_range);

/// A digest as a counter: exact in a double.
double as_counter(std::uint64_t digest);

/// Bytes of heap in use: what malloc rounds up and its chunk heads are counted, what is freed is not.
double heap_in_use();

/// The first `count` scans of the kitchen of ../shared/data. Read once and kept,
/// as are the others. Throws Error(data) if they are missing.
const Scans& kitchen_scans(std::size_t count);
const Scans& hall_scans(std::size_t count);    ///< of lidar_balm_realworld
const Scans& office_scans(std::size_t count);  ///< a simulated spinning lidar's

/// "2 cm", "d:0.02"
std::string centimetres(double metres);
std::string key(char letter, double value);

/// A folder of its own under the system's temporary one, gone with the program.
const std::filesystem::path& scratch_folder();

// Each registers benchmarks; brief: few scans each.
void add_insertion(bool brief);
void add_whole_runs(bool brief);

}  // namespace octosurf::bench
