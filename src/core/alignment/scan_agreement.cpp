#include "alignment/scan_agreement.hpp"

#include "sensing/reading_code.hpp"

#include <cmath>
#include <numbers>

namespace octosurf::alignment {
namespace {

constexpr std::size_t samples = 400;  // effort: a share of 90 % is then known to 1.5 %

}  // namespace

Agreement agreement_of(const surfaces::MapState& map, const Scan& scan, const Eigen::Isometry3d& T_map_sensor,
                       const RangeLimits& limits) {
  const double d = map.parameters.occupancy.resolution;
  std::vector<occupancy::SightLine> lines;
  for (std::size_t k = 0; k < samples && !scan.points.empty(); ++k) {
    // Multiples of the golden ratio spread evenly over pictures and rings of any size.
    const double place = std::fmod(static_cast<double>(k) * std::numbers::phi, 1);
    const auto i = static_cast<std::size_t>(place * static_cast<double>(scan.points.size()));
    const Eigen::Vector3d p = scan.points[i].cast<double>();
    Eigen::Vector3d start = Eigen::Vector3d::Zero();
    if (i < scan.origins.size()) start = scan.origins[i].cast<double>();
    const double range = (p - start).norm();
    if (!(range >= limits.min_m && range <= limits.max_m)) continue;  // NaN
    const unsigned range_class = sensing::range_class_of(static_cast<float>(range)) & 0xf;
    // Within a voxel and a deviation; with three, half of what a jump of 10 cm contradicts is near enough.
    lines.push_back(
        {T_map_sensor * start, T_map_sensor * p, d + std::sqrt(map.noise.reading_variance(range_class))});
  }
  return map.occupancy.agreement_with(lines);
}

}  // namespace octosurf::alignment
