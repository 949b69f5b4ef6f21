// How far the poses of a real recording are off, as given and as mapping corrects them, where there is no
// truth but the scans themselves: beside PCL's point-to-plane registration of scans that overlap. Longer ways
// are chains of such links. The reference's own error shows where each link is gone in two halves instead.

#include "bench/pcl_registration.hpp"
#include "bench/support.hpp"
#include "sensing/downsample.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <filesystem>
#include <pcl/common/transforms.h>
#include <string>
#include <vector>

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

struct Options {
  std::string recording;
  std::vector<double> resolutions{0.02, 0.03, 0.04, 0.05};
  std::size_t half_link = 5;                ///< scans
  std::vector<std::size_t> gaps{1, 3, 10};  ///< links
};

/// Voxel of the points that are registered, m: fine enough for a camera's readings at 2 m, 3 to 6 mm.
constexpr double grain_m = 0.02;
/// Farther than poses drift between scans that overlap, the kitchen's by 6 cm; then less, so that what only
/// one of the scans saw does not draw.
constexpr std::array<double, 3> reaches_m{0.1, 0.05, 0.025};

using Poses = std::vector<Eigen::Isometry3d>;

struct Recording {
  std::vector<NormalCloud::Ptr> clouds;  ///< of every half link, in the sensor's frame
  Poses given;                           ///< of all scans
  double range_m = 0;                    ///< median of the readings'
};

std::filesystem::path path_of(const Options& options) {
  return options.recording.empty() ? kitchen() : std::filesystem::path(options.recording);
}

Recording read(const Options& options) {
  Recording recording;
  std::vector<double> ranges;
  for_each_scan(path_of(options), 1, 0, [&](const Scan& scan, double) {
    const bool kept = recording.given.size() % options.half_link == 0;
    recording.given.push_back(scan.T_map_sensor);
    if (!kept) return;
    const double max_range = sensing::default_max_range(scan.sensor);
    recording.clouds.push_back(thinned(cloud_of(scan, Eigen::Isometry3d::Identity(), max_range), grain_m));
    for (const auto& p : *recording.clouds.back()) ranges.push_back(p.getVector3fMap().norm());
  });
  recording.range_m = percentile(ranges, 0.5);
  return recording;
}

/// Pose of kept scan b in kept scan a's frame.
Eigen::Isometry3d registered(const Recording& recording, std::size_t half_link, std::size_t a,
                             std::size_t b) {
  Eigen::Isometry3d way = recording.given[a * half_link].inverse() * recording.given[b * half_link];
  for (const double reach_m : reaches_m) {
    const NormalCloud::Ptr moved(new NormalCloud);
    pcl::transformPointCloudWithNormals(*recording.clouds[b], *moved, way.matrix());
    way = register_points(moved, recording.clouds[a], reach_m) * way;
  }
  return way;
}

/// What registration says of the way: poses at the links' ends, from the first.
Poses chain(const Recording& recording, std::size_t half_link, std::size_t halves) {
  Poses poses{Eigen::Isometry3d::Identity()};
  for (std::size_t b = halves; b < recording.clouds.size(); b += halves)
    poses.push_back(poses.back() * registered(recording, half_link, b - halves, b));
  return poses;
}

/// How far a point at the usual range before the sensor is off after `links` links, mm, wherever one begins.
std::vector<double> errors(const Poses& reference, const Poses& poses, std::size_t links, double range_m) {
  std::vector<double> errors_mm;
  const Eigen::Vector3d ahead(0, 0, range_m);
  for (std::size_t i = 0; i + links < reference.size(); ++i) {
    const Eigen::Isometry3d true_way = reference[i].inverse() * reference[i + links],
                            way = poses[i].inverse() * poses[i + links];
    errors_mm.push_back(1e3 * (true_way.inverse() * way * ahead - ahead).norm());
  }
  return errors_mm;
}

Poses every(const Poses& all, std::size_t step) {
  Poses some;
  for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

struct Mapped {
  Poses poses;
  std::size_t corrected = 0;
};

Mapped map_at(const Options& options, double resolution) {
  Parameters parameters;
  parameters.occupancy.resolution = resolution;
  Mapper mapper(parameters);
  Mapped mapped;
  for_each_scan(path_of(options), 1, 0, [&](const Scan& scan, double) {
    const ScanReport report = mapper.insert(scan);
    mapped.poses.push_back(report.alignment.T_map_sensor);
    mapped.corrected += report.alignment.outcome == AlignmentOutcome::corrected ||
                        report.alignment.outcome == AlignmentOutcome::recovered;
  });
  return mapped;
}

void run(const Options& options) {
  const Recording recording = read(options);
  const std::size_t half = options.half_link, link = 2 * half;
  const Poses reference = chain(recording, half, 2);
  std::vector<std::string> header{"poses", "corrected"};
  for (const std::size_t gap : options.gaps)
    header.insert(header.end(), {"mm p50 over " + std::to_string(gap * link), "p95"});
  TextTable table(std::move(header));
  const auto add = [&](const std::string& name, const std::string& corrected, const Poses& poses) {
    std::vector<std::string> row{name, corrected};
    for (const std::size_t gap : options.gaps) {
      const std::vector<double> mm = errors(reference, poses, gap, recording.range_m);
      const bool none = mm.empty();  // the recording is shorter
      row.insert(row.end(),
                 {none ? "-" : fixed(percentile(mm, 0.5), 1), none ? "-" : fixed(percentile(mm, 0.95), 1)});
    }
    table.add(std::move(row));
  };
  add("registered in two halves", "", every(chain(recording, half, 1), 2));
  add("given", "", every(recording.given, link));
  for (const double resolution : options.resolutions) {
    const Mapped mapped = map_at(options, resolution);
    add("mapped at " + fixed(resolution, 2) + " m", std::to_string(mapped.corrected),
        every(mapped.poses, link));
  }
  std::printf("%s", table.text().c_str());
}

}  // namespace
}  // namespace octosurf::bench

int main(int argc, char** argv) {
  using namespace octosurf::bench;
  Options options;
  CLI::App app{"how far a real recording's poses are off, by the scans themselves"};
  app.add_option("recording", options.recording, "[the kitchen]");
  app.add_option("--resolution", options.resolutions)->capture_default_str();
  app.add_option("--half-link", options.half_link,
                 "half as many scans as lie between two that are registered; those must overlap")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--gaps", options.gaps, "in links")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return guarded_main([&] { run(options); });
}
