// Table I of the paper beside ours: same columns, same meaning (docs/formats.md §1).

#include "backlog.hpp"
#include "bench/support.hpp"
#include "run_statistics.hpp"
#include "simulation/recording.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> rows{"simple", "complex", "real"};
  std::vector<double> resolutions{0.02, 0.01};
  std::string sensor = "depth";
  std::uint64_t runs = 5;
  std::optional<std::size_t> frames;
  std::string input, preset = "default", json;
  int threads = 1;
  std::size_t together = 16;  // as by `octosurf map`
};

struct Numbers {
  double points_per_second = 0, first_detection_s = 0, lag_s = 0, categorized_percent = 0;
};

/// Table I as printed; laser scanner, 8 cores at 3.4 GHz, steps of one second.
std::optional<Numbers> of_the_paper(const std::string& row, double resolution) {
  struct Line {
    const char* row;
    double resolution;
    Numbers numbers;
  };
  static constexpr Line table[] = {
      {"simple", 0.02, {4900, 1.02, 0.305, 96.0}},  {"simple", 0.01, {8000, 0.221, 0.468, 93.0}},
      {"complex", 0.02, {4100, 1.01, 0.151, 90.4}}, {"complex", 0.01, {6900, 0.512, 0.399, 91.3}},
      {"real", 0.02, {12000, 1.41, 1.59, 78.2}},    {"real", 0.01, {19000, 1.94, 3.04, 72.3}}};
  for (const Line& line : table)
    if (row == line.row && resolution == line.resolution) return line.numbers;
  return std::nullopt;
}

/// Feeds scans as `octosurf map --realtime` does: a scan arrives at its time stamp and waits until those
/// before it are done; where mapping falls behind, scans that wait are mapped together. Time runs by the
/// stamps and the measured milliseconds, so nothing has to sleep.
class LiveRun {
 public:
  LiveRun(const Parameters& parameters, int threads, std::size_t together)
      : mapper_(parameters, threads), statistics_(parameters), together_(together), backlog_(together) {}

  void arrive(Scan scan) {
    map_until(scan.stamp_s);
    waiting_.push_back(std::move(scan));
  }
  /// No more scans arrive.
  void finish() { map_until(std::numeric_limits<double>::infinity()); }

  Numbers numbers() const {
    const nlohmann::json report = nlohmann::json::parse(statistics_.to_json(mapper_.map()));
    const auto number = [](const nlohmann::json& value) {  // null: not defined, e.g. nothing detected
      return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
    };
    return {number(report.at("points_per_second")), number(report.at("time_to_first_detection_s")),
            number(report.at("detection_lag_s").at("mean")), number(report.at("categorized_percent"))};
  }

 private:
  /// Whatever is begun before then.
  void map_until(double stamp_s) {
    while (!waiting_.empty()) {
      const double arrived_s = waiting_.front().stamp_s, start_s = std::max(arrived_s, free_at_s_);
      if (start_s >= stamp_s) return;
      backlog_.next(arrived_s, start_s - arrived_s);
      std::size_t count = 1;
      for (; backlog_.join() && count < std::min(together_, waiting_.size()); ++count) {
        if (waiting_[count].stamp_s > start_s) break;
        backlog_.joined(waiting_[count].stamp_s);
      }
      insert(count, start_s);
    }
  }

  void insert(std::size_t count, double start_s) {
    const std::vector<Scan> scans(
        std::make_move_iterator(waiting_.begin()),
        std::make_move_iterator(waiting_.begin() + static_cast<std::ptrdiff_t>(count)));
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<ScanReport> reports;
    const double took_s =
        time_ms([&] {
          while (reports.size() < count)  // it stops before one that is refused, which then throws
            std::ranges::move(mapper_.insert_all(std::span(scans).subspan(reports.size())),
                              std::back_inserter(reports));
        }) /
        1000;
    free_at_s_ = start_s + took_s;
    backlog_.mapped(took_s);
    for (std::size_t i = 0; i < reports.size(); ++i)
      statistics_.add(scans[i], reports[i], scans[i].stamp_s, free_at_s_);
  }

  Mapper mapper_;
  RunStatistics statistics_;
  std::size_t together_;
  Backlog backlog_;
  std::deque<Scan> waiting_;
  double free_at_s_ = -std::numeric_limits<double>::infinity();
};

Parameters parameters_of(const Options& options, double resolution) {
  if (options.preset != "default" && options.preset != "paper")
    throw Error(Error::Kind::usage, "--preset " + options.preset, "is unknown", "use default or paper");
  Parameters parameters = options.preset == "paper" ? Parameters::paper() : Parameters();
  parameters.occupancy.resolution = resolution;
  if (options.preset == "paper")  // s follows d
    parameters.surfaces.surface_tolerance = parameters.surfaces.sensor_noise + resolution * std::sqrt(3.0);
  return parameters;
}

Numbers mean_of(const std::vector<Numbers>& runs) {
  Numbers mean;
  const auto count = static_cast<double>(runs.size());
  for (const Numbers& run : runs) {
    mean.points_per_second += run.points_per_second / count;
    mean.first_detection_s += run.first_detection_s / count;
    mean.lag_s += run.lag_s / count;
    mean.categorized_percent += run.categorized_percent / count;
  }
  return mean;
}

Numbers measure(const Options& options, const std::string& row, double resolution) {
  const Parameters parameters = parameters_of(options, resolution);
  std::vector<Numbers> runs;
  if (row == "real") {
    LiveRun run(parameters, options.threads, options.together);
    const std::filesystem::path input =
        options.input.empty() ? kitchen() : std::filesystem::path(options.input);
    for_each_scan(input, 1, options.frames.value_or(0), [&](const Scan& scan, double) { run.arrive(scan); });
    run.finish();
    return run.numbers();
  }
  if (row != "simple" && row != "complex")
    throw Error(Error::Kind::usage, "--rows " + row, "is unknown", "use simple, complex, real");
  for (std::uint64_t seed = 1; seed <= options.runs; ++seed) {
    LiveRun run(parameters, options.threads, options.together);
    simulation::SimulationOptions simulation;
    simulation.scene = row == "simple" ? "room" : "office";
    simulation.sensor = options.sensor;
    simulation.seed = seed;
    const simulation::Recording recording(simulation);
    const std::size_t scans = std::min(options.frames.value_or(recording.size()), recording.size());
    for (std::size_t i = 0; i < scans; ++i) run.arrive(recording.scan(i));
    run.finish();
    runs.push_back(run.numbers());
  }
  return mean_of(runs);
}

std::string beside(const std::optional<double>& paper, double ours, int digits) {
  return (paper ? fixed(*paper, digits) : std::string("–")) + " | " + fixed(ours, digits);
}

void body(const Options& options) {
  TextTable table({"environment (paper | ours)", "d", "points per second", "time to first detection (s)",
                   "detection lag (s)", "% of points categorised"});
  nlohmann::json rows = nlohmann::json::array();
  for (const std::string& row : options.rows)
    for (const double resolution : options.resolutions) {
      const Numbers ours = measure(options, row, resolution);
      const std::optional<Numbers> paper = of_the_paper(row, resolution);
      const auto of_paper = [&](double Numbers::*field) {
        return paper ? std::optional<double>((*paper).*field) : std::nullopt;
      };
      const std::string name = row == "simple"    ? "simulated simple (room)"
                               : row == "complex" ? "simulated complex (office)"
                                                  : "real-world complex (kitchen)";
      table.add({name, fixed(resolution, 2),
                 beside(of_paper(&Numbers::points_per_second), ours.points_per_second, 0),
                 beside(of_paper(&Numbers::first_detection_s), ours.first_detection_s, 3),
                 beside(of_paper(&Numbers::lag_s), ours.lag_s, 3),
                 beside(of_paper(&Numbers::categorized_percent), ours.categorized_percent, 1)});
      rows.push_back({{"environment", row},
                      {"resolution", resolution},
                      {"points_per_second", ours.points_per_second},
                      {"time_to_first_detection_s", ours.first_detection_s},
                      {"detection_lag_s", ours.lag_s},
                      {"categorized_percent", ours.categorized_percent}});
      std::fprintf(stderr, "%s, d = %g m: done\n", name.c_str(), resolution);
    }
  std::printf(
      "Table I. Paper: laser scanner, 8 cores. Ours: %s sensor (kitchen: Kinect), %d thread(s), preset "
      "%s,\nmean of %zu seeds (kitchen: one run).\n%s",
      options.sensor.c_str(), options.threads, options.preset.c_str(), static_cast<std::size_t>(options.runs),
      table.text().c_str());
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"Table I of the paper beside ours"};
  app.add_option("--rows", options.rows, "of simple, complex, real")->delimiter(',')->capture_default_str();
  app.add_option("--resolution", options.resolutions, "d, m")->delimiter(',')->capture_default_str();
  app.add_option("--sensor", options.sensor, "of the simulated rows")->capture_default_str();
  app.add_option("--runs", options.runs, "seeds of the simulated rows")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--frames", options.frames, "at most so many scans each (default: all)");
  app.add_option("--input", options.input, "the real recording (default: the kitchen of ../shared/data)");
  app.add_option("--preset", options.preset, "default or paper")->capture_default_str();
  app.add_option("--threads", options.threads, "of Mapper")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--together", options.together,
                 "scans that wait are mapped together, so many at most; 1: never")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
