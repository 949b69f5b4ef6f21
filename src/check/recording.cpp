#include "check/recording.hpp"

#include "geometry/median.hpp"
#include "judgement/view.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace octosurf::check {
namespace {

/// Thinned, without what is no reading.
std::vector<Eigen::Vector3f> readings_of(const Scan& scan) {
  std::vector<Eigen::Vector3f> readings = judgement::thinned(scan.points);
  std::erase_if(readings, [](const Eigen::Vector3f& p) { return !p.allFinite() || p.isZero(); });
  return readings;
}

}  // namespace

void Recording::add(const Scan& scan) {
  constexpr double lever_m = 2;  // a room's: what turns move by
  poses_.push_back(
      {scan.name, scan.stamp_s, scan.T_map_sensor, oddities_.add(scan, scan.T_map_sensor, lever_m)});
  if (!kept_.wants()) return;
  KeptScan kept{poses_.size() - 1, {}};
  kept.scan.name = scan.name;
  kept.scan.sensor = scan.sensor;
  kept.scan.T_map_sensor = scan.T_map_sensor;
  kept.scan.points = readings_of(scan);
  kept_.take(std::move(kept));
}

double Recording::median_range() const {
  std::vector<float> ranges;
  for (const KeptScan& scan : kept())
    for (std::size_t i = 0; i < scan.scan.points.size(); i += 10)
      ranges.push_back(scan.scan.points[i].norm());
  return ranges.empty() ? 0 : static_cast<double>(geometry::median_of(ranges));
}

std::optional<double> Recording::most_frequent_range() const {
  std::map<long, std::size_t> counts;  // by mm
  std::size_t all = 0;
  for (const KeptScan& scan : kept())
    for (const Eigen::Vector3f& p : scan.scan.points) {
      ++counts[std::lround(1000 * (is_camera() ? p.z() : p.norm()))];
      ++all;
    }
  const auto most = std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
  if (most == counts.end() || 100 * most->second < all) return {};
  return static_cast<double>(most->first) / 1000;
}

std::optional<std::size_t> Recording::jump() const {
  const auto step = oddities_.longest_step(parameters_.occupancy.resolution);
  return step ? std::optional(step->scan) : std::nullopt;
}

std::string facts_of(const Recording& recording) {
  for (const Recording::Pose& pose : recording.poses())
    if (pose.T_map_sensor.linear() != recording.poses().front().T_map_sensor.linear()) return "";
  return "all poses have one rotation: where the sensor turned nobody knows; ";
}

}  // namespace octosurf::check
