// How exactly a scan's pose is told by what is known already: ours beside PCL's point-to-plane registration,
// from the same starts, against the same map or the same other scan.

#include "alignment/near_surfaces.hpp"
#include "alignment/pose_search.hpp"
#include "bench/pcl_registration.hpp"
#include "bench/support.hpp"
#include "sensing/downsample.hpp"
#include "sensing/noise_model.hpp"
#include "simulation/recording.hpp"

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <cstdio>
#include <numbers>
#include <random>

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

constexpr double deg = 180 / std::numbers::pi;

struct Options {
  std::vector<std::string> scenes{"room", "office", "stairs", "stones"};
  std::vector<std::uint64_t> seeds{1};
  std::string sensor = "depth";
  double resolution = 0.02;
  double off_m = 0.015, off_deg = 0.3;
  bool pairs = false;
  std::size_t step = 3, pcl_every = 5;
};

struct Errors {
  std::vector<double> given_mm, ours_mm, pcl_given_mm, pcl_ours_mm, pcl_mm, ours_ms, pcl_ms;
  double squared = 0;
  std::vector<double> squares;  ///< per scan and dimension
  int dimensions = 0;
};

/// What is known: a map's surfaces, and the points they came from.
struct Known {
  std::shared_ptr<const Snapshot> map;
  NormalCloud::Ptr points;
  alignment::NearSurfaces surfaces{};  ///< kept from scan to scan, as while mapping
};

class Contest {
 public:
  explicit Contest(const Options& options) : options_(options) {}

  void add(Known& known, Scan scan, const Eigen::Isometry3d& truth, bool with_pcl, Errors& errors) const {
    const AlignmentReach reach{3 * options_.off_m, 3 * options_.off_deg / deg};
    const double max_range = sensing::default_max_range(scan.sensor);
    alignment::PoseFit fit;
    sensing::NoiseModel noise{Parameters()};
    noise.observe(scan);
    const double ours_ms = time_ms([&] {
      const alignment::PoseSearch search(*known.map, known.surfaces, scan, noise, {0, max_range},
                                         scan.T_map_sensor, reach);
      fit = search.fine(scan.T_map_sensor, alignment::uncertainty(reach.rotation_rad, options_.resolution));
    });
    const alignment::Determined determined = alignment::determined_by(fit, options_.resolution);
    Alignment alignment;
    alignment::describe(fit, determined, 1, reach, alignment);
    if (alignment.determined == 0) return;
    const auto error_mm = [&](const Eigen::Isometry3d& T) {
      return 1e3 * alignment.determined_length_m(alignment::twist_between(truth, T));
    };
    errors.ours_ms.push_back(ours_ms);
    errors.given_mm.push_back(error_mm(scan.T_map_sensor));
    errors.ours_mm.push_back(error_mm(fit.T_map_sensor));
    note_consistency(alignment, alignment::twist_between(truth, fit.T_map_sensor), errors);
    if (!with_pcl) return;
    errors.pcl_given_mm.push_back(errors.given_mm.back());
    errors.pcl_ours_mm.push_back(errors.ours_mm.back());
    Eigen::Isometry3d registered;
    errors.pcl_ms.push_back(time_ms([&] { registered = by_pcl(known, scan, max_range); }));
    errors.pcl_mm.push_back(error_mm(registered));
  }

 private:
  static void note_consistency(const Alignment& alignment, const Twist& error, Errors& errors) {
    Twist in_metres;
    in_metres << Eigen::Vector3d::Constant(alignment.lever_m), Eigen::Vector3d::Ones();
    const Eigen::MatrixXd along =
        alignment.directions.leftCols(alignment.determined).transpose() * in_metres.asDiagonal();
    const Eigen::VectorXd off = along * error;
    const double squared = off.dot((along * alignment.covariance * along.transpose()).ldlt().solve(off));
    errors.squared += squared;
    errors.squares.push_back(squared / alignment.determined);
    errors.dimensions += alignment.determined;
  }

  Eigen::Isometry3d by_pcl(const Known& known, const Scan& scan, double max_range) const {
    const NormalCloud::Ptr source =
        thinned(cloud_of(scan, scan.T_map_sensor, max_range), options_.resolution);
    return register_points(source, known.points, 3 * options_.resolution) * scan.T_map_sensor;
  }

  const Options& options_;
};

Known known_from(const simulation::Recording& recording, const std::vector<std::size_t>& scans,
                 const Options& options) {
  Parameters parameters;
  parameters.occupancy.resolution = options.resolution;
  parameters.alignment.enabled = false;
  Mapper mapper(parameters);
  const PointCloud::Ptr all(new PointCloud);
  for (const std::size_t i : scans) {
    const Scan scan = recording.scan(i);
    mapper.insert(scan);
    *all += *cloud_of(scan, scan.T_map_sensor, sensing::default_max_range(scan.sensor));
  }
  return {mapper.snapshot(), thinned(all, options.resolution)};
}

Eigen::Vector3d direction(std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  return Eigen::Vector3d(gauss(rng), gauss(rng), gauss(rng)).normalized();
}

void run(const Options& options, const std::string& scene, std::uint64_t seed, TextTable& table) {
  simulation::SimulationOptions simulation;
  simulation.scene = scene;
  simulation.sensor = options.sensor;
  simulation.seed = seed;
  const simulation::Recording recording(simulation);
  std::mt19937_64 rng(seed);
  const Contest contest(options);
  Errors errors;
  const auto ask = [&](Known& known, std::size_t i) {
    Scan scan = recording.scan(i);
    const Eigen::Isometry3d truth = scan.T_map_sensor;
    Twist off;
    off << options.off_deg / deg * direction(rng), options.off_m * direction(rng);
    scan.T_map_sensor = alignment::moved(truth, off);
    contest.add(known, scan, truth, i % options.pcl_every == 0, errors);
  };
  if (options.pairs) {
    for (std::size_t i = 0; i + options.step < recording.size(); ++i) {
      Known other = known_from(recording, {i + options.step}, options);
      ask(other, i);
    }
  } else {
    // Scans that the map has not seen: every other one.
    std::vector<std::size_t> mapped;
    for (std::size_t i = 1; i < recording.size(); i += 2) mapped.push_back(i);
    Known known = known_from(recording, mapped, options);
    for (std::size_t i = 0; i < recording.size(); i += 2) ask(known, i);
  }
  table.add({scene + " " + std::to_string(seed), std::to_string(errors.given_mm.size()),
             fixed(percentile(errors.given_mm, 0.5), 2), fixed(percentile(errors.ours_mm, 0.5), 2),
             fixed(percentile(errors.ours_mm, 0.95), 2), fixed(errors.squared / errors.dimensions, 2),
             fixed(percentile(errors.squares, 0.95), 2), fixed(percentile(errors.ours_ms, 0.5), 2),
             std::to_string(errors.pcl_mm.size()), fixed(percentile(errors.pcl_ours_mm, 0.5), 2),
             fixed(percentile(errors.pcl_mm, 0.5), 2), fixed(percentile(errors.pcl_mm, 0.95), 2),
             fixed(percentile(errors.pcl_ms, 0.5), 1)});
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  using namespace octosurf::bench;
  Options options;
  CLI::App app{"a scan's pose against what is known: ours beside PCL's point-to-plane registration"};
  app.add_option("--scenes", options.scenes)->delimiter(',')->capture_default_str();
  app.add_option("--seeds", options.seeds)->capture_default_str();
  app.add_option("--sensor", options.sensor)->capture_default_str();
  app.add_option("--resolution", options.resolution)->capture_default_str();
  app.add_option("--off-m", options.off_m, "of the starts")->capture_default_str();
  app.add_option("--off-deg", options.off_deg)->capture_default_str();
  app.add_flag("--pairs", options.pairs,
               "against one other scan each, not against the map of every other one");
  app.add_option("--step", options.step, "--pairs: to the other scan")->capture_default_str();
  app.add_option("--pcl-every", options.pcl_every, "PCL is asked for every so many scans")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return guarded_main([&] {
    TextTable table({"recording", "scans", "given mm p50", "ours p50", "p95", "NEES/dim", "p95", "ms",
                     "PCL's scans", "ours p50", "PCL p50", "p95", "ms"});
    for (const std::string& scene : options.scenes)
      for (const std::uint64_t seed : options.seeds) run(options, scene, seed, table);
    std::printf("%s", table.text().c_str());
  });
}
