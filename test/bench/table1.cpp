// Table I of the paper beside ours: same columns, same meaning (docs/formats.md §1). As the paper measured
// it: a tilting laser, data in increments of one second, the paper's parameters.

#include "bench/support.hpp"
#include "run_statistics.hpp"
#include "simulation/recording.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
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
  std::string sensor = "tilting";
  double increment_s = 1;
  // One in so many readings of the real recording, so that at 2 cm as many are new as in the paper's: a laser
  // has fewer than a camera.
  std::size_t thinned = 24;
  std::uint64_t runs = 5;
  std::optional<std::size_t> frames;
  std::string input, json;
  int threads = 1;
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

/// Feeds scans in increments, each at its end and all of it together. Time runs by the stamps and the
/// measured milliseconds, so nothing has to sleep.
class LiveRun {
 public:
  LiveRun(const Parameters& parameters, const Options& options)
      : mapper_(parameters, options.threads, paper_detector()),
        statistics_(parameters),
        increment_s_(options.increment_s) {}

  void arrive(Scan scan) {
    if (!first_s_) first_s_ = scan.stamp_s;
    const double at_s =
        *first_s_ + increment_s_ * (1 + std::floor((scan.stamp_s - *first_s_) / increment_s_));
    if (at_s > increment_at_s_) finish();
    increment_at_s_ = at_s;
    scans_.push_back(std::move(scan));
  }
  /// Maps what has come together.
  void finish() {
    const double start_s = std::max(increment_at_s_, free_at_s_);
    std::vector<ScanReport> reports;
    const double took_s =
        time_ms([&] {
          while (reports.size() < scans_.size())  // it stops before one that is refused, which then throws
            std::ranges::move(mapper_.insert_all(std::span(scans_).subspan(reports.size())),
                              std::back_inserter(reports));
        }) /
        1000;
    free_at_s_ = start_s + took_s;
    for (std::size_t i = 0; i < reports.size(); ++i)
      statistics_.add(scans_[i], reports[i], increment_at_s_, free_at_s_);
    scans_.clear();
  }

  Numbers numbers() const {
    const nlohmann::json report = nlohmann::json::parse(statistics_.to_json(mapper_.map()));
    const auto number = [](const nlohmann::json& value) {  // null: not defined, e.g. nothing detected
      return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
    };
    return {number(report.at("points_per_second")), number(report.at("time_to_first_detection_s")),
            number(report.at("detection_lag_s").at("mean")), number(report.at("categorized_percent"))};
  }

 private:
  Mapper mapper_;
  RunStatistics statistics_;
  double increment_s_;
  std::optional<double> first_s_;
  std::vector<Scan> scans_;
  double increment_at_s_ = 0, free_at_s_ = -std::numeric_limits<double>::infinity();
};

Parameters parameters_of(const std::string& detector, double resolution) {
  Parameters parameters = paper_parameters(resolution, Parameters::paper().search_radius());
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
  Parameters parameters = parameters_of(detector, resolution);
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
      "the paper's parameters,\nincrements of %g s, mean of %zu seeds (kitchen: one run).\n%s",
      options.sensor.c_str(), options.thinned, options.threads, options.increment_s,
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
  app.add_option("--increment", options.increment_s, "s of data handed over together")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--thin", options.thinned, "one in so many readings of the real recording")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--runs", options.runs, "seeds of the simulated rows")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--frames", options.frames, "at most so many scans each (default: all)");
  app.add_option("--input", options.input, "the real recording (default: the kitchen of ../shared/data)");
  app.add_option("--threads", options.threads, "of Mapper")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", options.json, "write the numbers there");
  CLI11_PARSE(app, argc, argv);
  return octosurf::bench::guarded_main([&] { octosurf::bench::body(options); });
}
