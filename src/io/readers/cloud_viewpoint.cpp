#include "io/readers/reading_rules.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace octosurf::io {
namespace {

// In a sensor's own frame, only the angular resolution hides readings at edges: up to 6 % in six clouds
// measured; in two composed in another frame 43 and 73 %.
constexpr double hidden_by_edges = 0.25;
// Angular resolution, rad: the rows of a lidar with 64 beams are half as far apart.
constexpr double direction_width = std::numbers::pi / 180;
// Of the nearest distance: a floor seen at 5°, over one direction's width.
constexpr double slanted = 1.25;
constexpr double thickness_m = 0.15;  // of a surface with its noise: three voxels of a lidar's map
// Heights within a cell of twice these voxels' edge: a riser of 20 cm hides itself, and little else.
constexpr double column_m = 0.1;

/// Share of the readings that lie farther than the nearest of their bin by more than `slack` times its
/// distance and a surface's thickness. bin_of(point) → (bin, distance).
template <class BinOf>
double hidden_share(const std::vector<Eigen::Vector3d>& points, double slack, BinOf&& bin_of) {
  std::map<std::pair<double, double>, double> nearest;
  for (const Eigen::Vector3d& p : points) {
    const auto [bin, distance] = bin_of(p);
    double& least = nearest.try_emplace(bin, distance).first->second;
    least = std::min(least, distance);
  }
  std::size_t hidden = 0;
  for (const Eigen::Vector3d& p : points) {
    const auto [bin, distance] = bin_of(p);
    hidden += distance > slack * nearest[bin] + thickness_m;
  }
  return static_cast<double>(hidden) / static_cast<double>(std::max<std::size_t>(1, points.size()));
}

/// A whole number, of which int64_t does not have all.
double cell(double value, double width) { return std::floor(value / width); }

}  // namespace

std::optional<CloudViewpoint> likely_viewpoint(const Scan& cloud) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.allFinite()) points.push_back(p.cast<double>());
  if (points.empty()) return {};
  CloudViewpoint found;
  found.hidden_origin = hidden_share(points, slanted, [](const Eigen::Vector3d& p) {
    const double azimuth = std::atan2(p.y(), p.x()), elevation = std::atan2(p.z(), p.head<2>().norm());
    return std::pair(std::pair(cell(azimuth, direction_width), cell(elevation, direction_width)), p.norm());
  });
  if (found.hidden_origin <= hidden_by_edges) return {};
  Eigen::Vector3d low = points.front(), high = low, sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
    sum += p;
  }
  found.hidden = hidden_share(points, 1, [&](const Eigen::Vector3d& p) {
    return std::pair(std::pair(cell(p.x(), column_m), cell(p.y(), column_m)), high.z() - p.z());
  });
  const double half_extent = (high - low).head<2>().norm() / 2;
  found.at = sum / static_cast<double>(points.size());
  found.at.z() = high.z() + std::max(1.0, half_extent);
  return found;
}

}  // namespace octosurf::io
