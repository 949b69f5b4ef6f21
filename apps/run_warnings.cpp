#include "run_warnings.hpp"

#include "alignment/sensor_error.hpp"
#include "io/text_file.hpp"
#include "surfaces/map_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <octosurf/diagnosis.hpp>

namespace octosurf {
namespace {

/// Clouds without poses are a sensor's that stands still, or have them in a file that was not given.
void warn_of_missing_poses(const RunStatistics& statistics) {
  const auto scans = static_cast<std::size_t>(statistics.scans());
  if (scans < 2 || statistics.scans_at_origin() < scans) return;
  std::fprintf(
      stderr,
      "warning: all %zu scans are mapped from the map's origin, as they came without poses; if the sensor "
      "has moved, --poses FILE gives them\n",
      scans);
}

/// If it stands out of its own uncertainty (four deviations: four numbers, one false alarm in 4,000 runs) and
/// moves the farthest readings by a tenth of a voxel, below which corrections are not made either.
void warn_of_sensor_error(const Map& map) {
  const auto error = alignment::sensor_error_of(map.state().alignment);
  if (!error) return;
  const Parameters& parameters = map.parameters();
  const double far = parameters.occupancy.max_range.value_or(4);  // m, as for a depth camera
  const double visible = parameters.occupancy.resolution / 10 / far;
  const auto stands_out = [&](double value, double deviation) {
    return std::fabs(value) > std::max(visible, 4 * deviation);
  };
  const double degrees = 180 / std::numbers::pi;
  const Eigen::Vector3d tilt = error->tilt_rad(), tilt_deg = degrees * tilt;
  if (stands_out(tilt.x(), error->tilt_deviation_rad(0)) ||
      stands_out(tilt.y(), error->tilt_deviation_rad(1)) ||
      stands_out(tilt.z(), error->tilt_deviation_rad(2)))
    std::fprintf(stderr,
                 "warning: the sensor seems to be tilted against its poses by %.2f, %.2f, %.2f° about its "
                 "x, y, z: check its mounting (extrinsic calibration); nothing was changed\n",
                 tilt_deg.x(), tilt_deg.y(), tilt_deg.z());
  if (stands_out(error->range_scale(), error->range_scale_deviation()))
    std::fprintf(stderr,
                 "warning: the readings seem to be too %s by %.1f %%: check the sensor's depth scale; "
                 "nothing was changed\n",
                 error->range_scale() > 0 ? "long" : "short", 100 * std::fabs(error->range_scale()));
}

void warn_of_closures(const RunStatistics& statistics) {
  const std::vector<mapper::LoopClosure>& closures = statistics.closures();
  if (closures.empty()) return;
  const mapper::LoopClosure& worst = *std::max_element(
      closures.begin(), closures.end(),
      [](const mapper::LoopClosure& a, const mapper::LoopClosure& b) { return a.farthest_m < b.farthest_m; });
  std::fprintf(
      stderr,
      "warning: %s where the poses do not meet what was mapped before, the farthest from %s to %s: %.1f cm; "
      "the way between is bent by as much, and remap straightens it with poses that close the loop\n",
      io::count_of(closures.size(), "place").c_str(), worst.first.c_str(), worst.last.c_str(),
      100 * worst.farthest_m);
}

void warn_of_double_layers(const Snapshot& snapshot, bool reported) {
  const std::vector<DoubleLayer> layers = double_layers(snapshot);
  if (layers.empty()) return;
  const DoubleLayer& worst = *std::max_element(
      layers.begin(), layers.end(),
      [](const DoubleLayer& a, const DoubleLayer& b) { return a.overlap_m2 < b.overlap_m2; });
  std::fprintf(stderr, "warning: %s of two surfaces on one face, e.g. %u and %u: %.2f m² %.1f cm apart; %s\n",
               io::count_of(layers.size(), "pair").c_str(), worst.first, worst.second, worst.overlap_m2,
               100 * worst.distance_m, reported ? "the report lists them" : "--report FILE lists them");
}

}  // namespace

void print_warnings(const RunStatistics& statistics, const Map& map, bool reported) {
  std::fflush(stdout);  // so that they follow the summary
  warn_of_missing_poses(statistics);
  warn_of_closures(statistics);
  warn_of_sensor_error(map);
  warn_of_double_layers(*map.snapshot(), reported);
}

}  // namespace octosurf
