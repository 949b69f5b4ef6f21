// Table I of the paper: same columns, same meaning (docs/formats.md §1). As the paper measured it: a tilting
// laser, data in increments of one second, the paper's h and r, n = 50.

#include "bench/bench.hpp"
#include "run_statistics.hpp"

#include <chrono>
#include <iterator>
#include <span>

namespace octosurf::bench {
namespace {

constexpr double increment_s = 1;  // of data, handed over together
// One in so many readings of the real recording, so that at 2 cm as many are new as in the paper's: a laser
// has fewer than a camera.
constexpr std::size_t thinned = 24;

/// Feeds scans in increments, each at its end and all of it together. Time runs by the stamps and by what
/// mapping takes, so nothing has to sleep.
class LiveRun {
 public:
  LiveRun(const Parameters& parameters, int threads)
      : mapper_(parameters, threads, paper_detector()), statistics_(parameters) {}

  void arrive(Scan scan) {
    if (!first_s_) first_s_ = scan.stamp_s;
    const double at_s = *first_s_ + increment_s * (1 + std::floor((scan.stamp_s - *first_s_) / increment_s));
    if (at_s > increment_at_s_) finish();
    increment_at_s_ = at_s;
    scans_.push_back(std::move(scan));
  }
  /// Maps what has come together.
  void finish() {
    const double start_s = std::max(increment_at_s_, free_at_s_);
    std::vector<ScanReport> reports;
    const auto before = std::chrono::steady_clock::now();
    while (reports.size() < scans_.size())  // it stops before one that is refused, which then throws
      std::ranges::move(mapper_.insert_all(std::span(scans_).subspan(reports.size())),
                        std::back_inserter(reports));
    free_at_s_ = start_s + std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    for (std::size_t i = 0; i < reports.size(); ++i)
      statistics_.add(scans_[i], reports[i], increment_at_s_, free_at_s_);
    scans_.clear();
  }
  Json numbers() {
    finish();
    const Json report = Json::parse(statistics_.to_json(mapper_.map()));
    return named("points_per_second time_to_first_detection_s detection_lag_s categorized_percent",
                 report.at("points_per_second"), report.at("time_to_first_detection_s"),
                 report.at("detection_lag_s").at("mean"), report.at("categorized_percent"));
  }

 private:
  Mapper mapper_;
  RunStatistics statistics_;
  std::optional<double> first_s_;
  std::vector<Scan> scans_;
  double increment_at_s_ = 0, free_at_s_ = -std::numeric_limits<double>::infinity();
};

/// Drawn, as every so many of a picture's rows are lines with gaps between them.
Scan thin(Scan scan) {
  std::mt19937_64 random(scan.points.size());
  std::erase_if(scan.points, [&](const Eigen::Vector3f&) { return random() % thinned != 0; });
  return scan;
}

void measure(const Options& options, const std::string& environment, const std::string& detector,
             double resolution) {
  Parameters parameters = Parameters::paper(resolution);
  set_parameter(parameters, "detector", detector);
  const Json row{{"environment", environment}, {"resolution", resolution}, {"detector", detector}};
  if (environment == "real") {
    // The paper had other parameters for its real sensor, too. This one's noise grows with the distance.
    parameters.surfaces.range_noise.reset();
    LiveRun run(parameters, options.threads);
    for_each_kitchen_scan(options, [&](const Scan& scan) { run.arrive(thin(scan)); });
    write(row, run.numbers());
    return;
  }
  if (environment != "simple" && environment != "complex")
    throw Error(Error::Kind::usage, "--scenes " + environment, "is unknown", "use simple, complex, real");
  for (const std::uint64_t seed : options.seeds) {
    LiveRun run(parameters, options.threads);
    simulation::SimulationOptions simulation;
    simulation.scene = environment == "simple" ? "room" : "office";
    simulation.sensor = options.sensors.front();
    simulation.seed = seed;
    const simulation::Recording recording(simulation);
    const std::size_t scans =
        options.frames > 0 ? std::min(options.frames, recording.size()) : recording.size();
    for (std::size_t i = 0; i < scans; ++i) run.arrive(recording.scan(i));
    write(row, run.numbers());
  }
}

}  // namespace

void table1(const Options& options) {
  for (const std::string& environment : options.scenes)
    for (const double resolution : options.resolutions)
      for (const std::string& detector : options.only) measure(options, environment, detector, resolution);
}

}  // namespace octosurf::bench
