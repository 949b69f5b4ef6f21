#pragma once

#include "bench/speed/contest.hpp"

#include <benchmark/benchmark.h>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::bench {

/// What the user of bench_speed asked for.
struct SpeedOptions {
  bool brief = false;               ///< few frames each
  std::vector<double> resolutions;  ///< m, of the kitchen's rows
  std::vector<int> threads;         ///< of the occupancy rows, a row each
  std::optional<std::size_t> frames;
  std::size_t every = 1;  ///< take every k-th of the kitchen's frames
  std::string input;      ///< in the kitchen's place

  std::size_t count(std::size_t brief_count, std::size_t full_count) const {
    return frames.value_or(brief ? brief_count : full_count);
  }
};

/// Numbers of a row by name, as they stand in the JSON. `ours_…` and `theirs_…` are in the unit the
/// name ends with; `ratio` says how many times better ours is, on medians.
using Numbers = std::map<std::string, double>;

/// One line of the table: one registered benchmark, measured when it is run.
struct Row {
  std::string name;     ///< group/…, for filters
  std::string what;     ///< what is done, for the table
  std::string against;  ///< the other side, for the table
  std::function<Numbers()> measure;
};

/// With Google Benchmark. Its time is ours_ms if there is one. An Error while measuring marks the row
/// as skipped, with the reason.
void register_row(const Row& row);

/// Medians and 95th percentiles of both sides, the ratio of the medians, where the ratios of the single
/// turns lie (10th and 90th percentile), and the ratio of the medians of CPU time.
Numbers compare(const std::vector<Turn>& ours, const std::vector<Turn>& theirs);

/// Prints a row's numbers as soon as it is measured.
class RowReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& /*context*/) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override;
};

std::vector<double> milliseconds(const std::vector<Turn>& turns);
double median(const std::vector<double>& values);

/// "2 cm"
std::string centimetres(double metres);

/// A folder of its own under the system's temporary one, gone with the program.
const std::filesystem::path& scratch_folder();

// Each registers the rows of one group.
void add_occupancy_rows(const SpeedOptions& options);
void add_plain_rows(const SpeedOptions& options);
void add_lidar_rows(const SpeedOptions& options);
void add_mapper_rows(const SpeedOptions& options);
void add_pcl_rows(const SpeedOptions& options);
void add_memory_rows(const SpeedOptions& options);
void add_loading_rows(const SpeedOptions& options);
void add_planes_rows(const SpeedOptions& options);
void add_normals_rows(const SpeedOptions& options);
void add_derive_rows(const SpeedOptions& options);
void add_long_run_rows(const SpeedOptions& options);
void add_app_rows(const SpeedOptions& options);

}  // namespace octosurf::bench
