// Table I of the paper beside ours: same columns, same meaning (docs/formats.md §1). As the paper measured
// it: a tilting laser, data in increments of one second, the paper's parameters; or as a camera's scans come.

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
#include <random>
#include <span>

#include <octosurf/adapters/paper_detector.hpp>
#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::vector<std::string> rows{"simple", "complex", "real"};
  std::vector<double> resolutions{0.02, 0.01};
  std::vector<std::string> detectors{"likelihood"};
  std::string sensor = "tilting", preset = "paper";
  double increment_s = 1;  // 0: each scan when it was taken
  // One in so many readings of the real recording, so that at 2 cm as many are new as in the paper's: a laser
  // has fewer than a camera.
  std::size_t thinned = 24;
  std::uint64_t runs = 5;
  std::optional<std::size_t> frames;
  std::string input, json;
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

/// Feeds scans as they arrive: in increments, each at its end and all of it together, or as `octosurf map
/// --realtime` does: a scan arrives at its time stamp and waits until those before it are done; where mapping
/// falls behind, scans that wait are mapped together. Time runs by the stamps and the measured milliseconds,
/// so nothing has to sleep.
class LiveRun {
 public:
  LiveRun(const Parameters& parameters, const Options& options)
      : mapper_(parameters, options.threads),
        statistics_(parameters),
        increment_s_(options.increment_s),
        together_(options.together),
        backlog_(together_) {}

  void arrive(Scan scan) {
    if (!first_s_) first_s_ = scan.stamp_s;
    double at_s = scan.stamp_s;
    if (increment_s_ > 0)
      at_s = *first_s_ + increment_s_ * (1 + std::floor((at_s - *first_s_) / increment_s_));
    map_until(at_s);
    waiting_.push_back({at_s, std::move(scan)});
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
  struct Arrival {
    double at_s = 0;
    Scan scan;
  };

  /// Whatever is begun before then.
  void map_until(double stamp_s) {
    while (!waiting_.empty()) {
      const double start_s = std::max(waiting_.front().at_s, free_at_s_);
      if (start_s >= stamp_s) return;
      insert(increment_s_ > 0 ? of_increment() : that_wait(start_s), start_s);
    }
  }

  std::size_t of_increment() const {
    const auto ends = std::find_if(waiting_.begin(), waiting_.end(),
                                   [&](const Arrival& a) { return a.at_s > waiting_.front().at_s; });
    return static_cast<std::size_t>(ends - waiting_.begin());
  }

  std::size_t that_wait(double start_s) {
    backlog_.next(waiting_.front().at_s, start_s - waiting_.front().at_s);
    std::size_t count = 1;
    for (; backlog_.join() && count < std::min(together_, waiting_.size()); ++count) {
      if (waiting_[count].at_s > start_s) break;
      backlog_.joined(waiting_[count].at_s);
    }
    return count;
  }

  void insert(std::size_t count, double start_s) {
    std::vector<double> arrivals_s;
    std::vector<Scan> scans;
    for (; scans.size() < count; waiting_.pop_front()) {
      arrivals_s.push_back(waiting_.front().at_s);
      scans.push_back(std::move(waiting_.front().scan));
    }
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
      statistics_.add(scans[i], reports[i], arrivals_s[i], free_at_s_);
  }

  Mapper mapper_;
  RunStatistics statistics_;
  double increment_s_;
  std::size_t together_;
  Backlog backlog_;
  std::optional<double> first_s_;
  std::deque<Arrival> waiting_;
  double free_at_s_ = -std::numeric_limits<double>::infinity();
};

Parameters parameters_of(const Options& options, const std::string& detector, double resolution) {
  if (options.preset != "default" && options.preset != "paper")
    throw Error(Error::Kind::usage, "--preset " + options.preset, "is unknown", "use default or paper");
  Parameters parameters = options.preset == "paper" ? Parameters::paper() : Parameters();
  parameters.occupancy.resolution = resolution;
  if (options.preset == "paper")  // s follows d
    parameters.surfaces.surface_tolerance = parameters.surfaces.sensor_noise + resolution * std::sqrt(3.0);
  set_parameter(parameters, "detector", detector);
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

/// Drawn, as every so many of a picture's rows are lines with gaps between them.
Scan thinned(Scan scan, std::size_t one_in) {
  std::mt19937_64 random(scan.points.size());
  std::erase_if(scan.points, [&](const Eigen::Vector3f&) { return random() % one_in != 0; });
  return scan;
}

Numbers measure(const Options& options, const std::string& row, const std::string& detector,
                double resolution) {
  Parameters parameters = parameters_of(options, detector, resolution);
  // The paper had other parameters for its real sensor, too. This one's noise grows with the distance.
  if (row == "real") parameters.surfaces.range_noise.reset();
  std::vector<Numbers> runs;
  if (row == "real") {
    LiveRun run(parameters, options);
    const std::filesystem::path input =
        options.input.empty() ? kitchen() : std::filesystem::path(options.input);
    for_each_scan(input, 1, options.frames.value_or(0),
                  [&](const Scan& scan, double) { run.arrive(thinned(scan, options.thinned)); });
    run.finish();
    return run.numbers();
  }
  if (row != "simple" && row != "complex")
    throw Error(Error::Kind::usage, "--rows " + row, "is unknown", "use simple, complex, real");
  for (std::uint64_t seed = 1; seed <= options.runs; ++seed) {
    LiveRun run(parameters, options);
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

std::string name_of(const std::string& row) {
  if (row == "real") return "real-world complex (kitchen)";
  return row == "simple" ? "simulated simple (room)" : "simulated complex (office)";
}

void body(const Options& options) {
  enable_paper_detector();
  TextTable table({"environment (paper | ours)", "d", "detector", "points per second",
                   "time to first detection (s)", "detection lag (s)", "% of points categorised"});
  nlohmann::json rows = nlohmann::json::array();
  for (const std::string& row : options.rows)
    for (const double resolution : options.resolutions) {
      const std::optional<Numbers> paper = of_the_paper(row, resolution);
      const auto of_paper = [&](double Numbers::*field) {
        return paper ? std::optional<double>((*paper).*field) : std::nullopt;
      };
      for (const std::string& detector : options.detectors) {
        const Numbers ours = measure(options, row, detector, resolution);
        table.add({name_of(row), fixed(resolution, 2), detector,
                   beside(of_paper(&Numbers::points_per_second), ours.points_per_second, 0),
                   beside(of_paper(&Numbers::first_detection_s), ours.first_detection_s, 3),
                   beside(of_paper(&Numbers::lag_s), ours.lag_s, 3),
                   beside(of_paper(&Numbers::categorized_percent), ours.categorized_percent, 1)});
        nlohmann::json entry{{"environment", row},
                             {"resolution", resolution},
                             {"detector", detector},
                             {"points_per_second", ours.points_per_second},
                             {"time_to_first_detection_s", ours.first_detection_s},
                             {"detection_lag_s", ours.lag_s},
                             {"categorized_percent", ours.categorized_percent}};
        if (paper)
          entry["paper"] = {{"points_per_second", paper->points_per_second},
                            {"time_to_first_detection_s", paper->first_detection_s},
                            {"detection_lag_s", paper->lag_s},
                            {"categorized_percent", paper->categorized_percent}};
        rows.push_back(std::move(entry));
        std::fprintf(stderr, "%s, d = %g m, %s: done\n", name_of(row).c_str(), resolution, detector.c_str());
      }
    }
  std::printf(
      "Table I. Paper: laser scanner, 8 cores. Ours: %s sensor (kitchen: Kinect, one reading in %zu), %d "
      "thread(s), "
      "preset %s,\nincrements of %g s, mean of %zu seeds (kitchen: one run).\n%s",
      options.sensor.c_str(), options.thinned, options.threads, options.preset.c_str(), options.increment_s,
      static_cast<std::size_t>(options.runs), table.text().c_str());
  if (!options.json.empty()) write_json_file(options.json, rows.dump(1));
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  octosurf::bench::Options options;
  CLI::App app{"Table I of the paper beside ours"};
  app.add_option("--rows", options.rows, "of simple, complex, real")->delimiter(',')->capture_default_str();
  app.add_option("--resolution", options.resolutions, "d, m")->delimiter(',')->capture_default_str();
  app.add_option("--detector", options.detectors, "of likelihood, paper")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--sensor", options.sensor, "of the simulated rows")->capture_default_str();
  app.add_option("--increment", options.increment_s,
                 "s of data handed over together; 0: each scan when it was taken")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--thin", options.thinned, "one in so many readings of the real recording")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--runs", options.runs, "seeds of the simulated rows")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--frames", options.frames, "at most so many scans each (default: all)");
  app.add_option("--input", options.input, "the real recording (default: the kitchen of ../shared/data)");
  app.add_option("--preset", options.preset, "default or paper: parameters but for the detector")
      ->capture_default_str();
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
