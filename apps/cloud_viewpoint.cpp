#include "cloud_viewpoint.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <octosurf/up.hpp>

namespace octosurf {
namespace {

// In a sensor's own frame, only the angular resolution hides readings at edges: up to 6 % in six clouds
// measured; in two composed in another frame 43 and 73 %.
constexpr double hidden_by_edges = 0.25;
// Angular resolution, rad: the rows of a lidar with 64 beams are half as far apart.
constexpr double direction_width = std::numbers::pi / 180;
// Of the nearest distance: a floor seen at 5°, over one direction's width.
constexpr double slanted = 1.25;

/// Share of the readings that lie farther than the nearest of their bin by more than `slack` times its
/// distance and `thickness`, m. bin_of(point) → (bin, distance).
template <class BinOf>
double hidden_share(const std::vector<Eigen::Vector3d>& points, double slack, double thickness,
                    BinOf&& bin_of) {
  std::map<std::pair<std::int64_t, std::int64_t>, double> nearest;
  for (const Eigen::Vector3d& p : points) {
    const auto [bin, distance] = bin_of(p);
    double& least = nearest.try_emplace(bin, distance).first->second;
    least = std::min(least, distance);
  }
  std::size_t hidden = 0;
  for (const Eigen::Vector3d& p : points) {
    const auto [bin, distance] = bin_of(p);
    hidden += distance > slack * nearest[bin] + thickness;
  }
  return static_cast<double>(hidden) / static_cast<double>(std::max<std::size_t>(1, points.size()));
}

std::int64_t cell(double value, double width) { return static_cast<std::int64_t>(std::floor(value / width)); }

}  // namespace

std::optional<CloudViewpoint> likely_viewpoint(const Scan& cloud, const Eigen::Vector3d& up,
                                               double resolution) {
  std::vector<Eigen::Vector3d> points;  // z up
  const Eigen::Quaterniond turn = upright(up);
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.allFinite()) points.push_back(turn * p.cast<double>());
  if (points.empty()) return {};
  const double thickness = 3 * resolution;  // of a surface with its noise, in voxels
  CloudViewpoint found;
  found.hidden_origin = hidden_share(points, slanted, thickness, [](const Eigen::Vector3d& p) {
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
  // Heights within a cell of twice the voxels' edge: a riser of 20 cm hides itself, and little else.
  found.hidden = hidden_share(points, 1, thickness, [&](const Eigen::Vector3d& p) {
    return std::pair(std::pair(cell(p.x(), 2 * resolution), cell(p.y(), 2 * resolution)), high.z() - p.z());
  });
  const double half_extent = (high - low).head<2>().norm() / 2;
  Eigen::Vector3d at = sum / static_cast<double>(points.size());
  at.z() = high.z() + std::max(1.0, half_extent);
  found.at = turn.inverse() * at;
  return found;
}

void set_viewpoint(Scan& cloud, const Eigen::Vector3d& at) {
  for (Eigen::Vector3f& p : cloud.points) p -= at.cast<float>();
  cloud.T_map_sensor.translate(at);
}

}  // namespace octosurf
