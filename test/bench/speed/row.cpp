#include "bench/speed/row.hpp"

#include "bench/support.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <octosurf/error.hpp>

namespace octosurf::bench {

void register_row(const Row& row) {
  benchmark::RegisterBenchmark(row.name.c_str(),
                               [row](benchmark::State& state) {
                                 state.SetLabel(row.what + " | " + row.against);
                                 try {
                                   for ([[maybe_unused]] auto _ : state) {
                                     const Numbers numbers = row.measure();
                                     const auto ours = numbers.find("ours_ms");
                                     state.SetIterationTime(ours == numbers.end() ? 0 : ours->second / 1000);
                                     for (const auto& [name, value] : numbers) state.counters[name] = value;
                                   }
                                 } catch (const std::exception& error) {
                                   state.SkipWithError(error.what());
                                 }
                               })
      ->UseManualTime()
      ->Iterations(1)
      ->Unit(benchmark::kMillisecond);
}

void RowReporter::ReportRuns(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    const std::string& name = run.run_name.function_name;
    std::printf("\n%s\n", name.c_str());
    if (run.error_occurred) {
      std::printf("  %s\n", run.error_message.c_str());
      continue;
    }
    std::printf("  %s\n ", run.report_label.c_str());
    for (const auto& [counter, value] : run.counters) std::printf(" %s=%g", counter.c_str(), value.value);
    std::printf("\n");
  }
  std::fflush(stdout);
}

std::vector<double> milliseconds(const std::vector<Turn>& turns) {
  std::vector<double> ms;
  for (const Turn& turn : turns) ms.push_back(turn.ms);
  return ms;
}

double median(const std::vector<double>& values) { return percentile(values, 0.5); }

Numbers compare(const std::vector<Turn>& ours, const std::vector<Turn>& theirs) {
  if (ours.size() != theirs.size() || ours.empty())
    throw Error(Error::Kind::data, "the recording", "has no scans");
  const std::vector<double> our_ms = milliseconds(ours), their_ms = milliseconds(theirs);
  std::vector<double> ratios, our_cpu_ms, their_cpu_ms;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    ratios.push_back(their_ms[i] / our_ms[i]);
    our_cpu_ms.push_back(ours[i].cpu_ms);
    their_cpu_ms.push_back(theirs[i].cpu_ms);
  }
  return {{"turns", static_cast<double>(ours.size())},
          {"ours_ms", median(our_ms)},
          {"theirs_ms", median(their_ms)},
          {"ours_p95_ms", percentile(our_ms, 0.95)},
          {"theirs_p95_ms", percentile(their_ms, 0.95)},
          {"ratio", median(their_ms) / median(our_ms)},
          {"ratio_p10", percentile(ratios, 0.1)},
          {"ratio_p90", percentile(ratios, 0.9)},
          {"cpu_ratio", median(their_cpu_ms) / median(our_cpu_ms)}};
}

std::string centimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%g cm", metres * 100);
  return text;
}

namespace {

struct ScratchFolder {
  std::filesystem::path path;
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "octosurf-bench-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw Error(Error::Kind::output, pattern, "cannot be created", "set TMPDIR");
    path = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

}  // namespace

const std::filesystem::path& scratch_folder() {
  static const ScratchFolder folder;
  return folder.path;
}

}  // namespace octosurf::bench
