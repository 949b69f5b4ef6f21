#include "simulation/mesh_walk.hpp"

#include "simulation/outside.hpp"
#include "simulation/ray_caster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

constexpr double lane_width =
    0.75;  // m: what the camera sees across at the lower rim of its image, nearest to the feet
constexpr double key_step = 0.05;   // m
constexpr double leg = 0.3;         // m: radius of the ground that carries the body
constexpr double body = 0.6;        // m: its length
constexpr double clearance = 0.25;  // m
constexpr double most_sway = 0.1;   // m to either side of a lane
constexpr std::size_t most_keys = 200'000;

/// Heights of what lies highest.
class Ground {
 public:
  Ground(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box)
      : caster_(scene_of(mesh, ""), {}, 0), top_(box.max().z() + 1), reach_(box.sizes().z() + 2) {}

  std::optional<double> at(const Eigen::Vector2d& p) const {
    const std::vector<Eigen::Vector3f> down{-Eigen::Vector3f::UnitZ()};
    const Hit hit = caster_.cast({p.x(), p.y(), top_}, down, reach_)[0];
    return hit.t > 0 ? std::optional(top_ - static_cast<double>(hit.t)) : std::nullopt;
  }

  /// Heights on two rings and in the middle of a disc, ascending.
  std::vector<double> within(const Eigen::Vector2d& p, double radius) const {
    std::vector<double> heights;
    for (int k = -1; k < 24; ++k) {
      const double angle_rad = 2 * std::numbers::pi * k / 12;
      const double r = k < 0 ? 0 : k < 12 ? radius / 2 : radius;
      if (const auto z = at(p + r * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad))))
        heights.push_back(*z);
    }
    std::sort(heights.begin(), heights.end());
    return heights;
  }

 private:
  RayCaster caster_;
  double top_, reach_;
};

/// Fills gaps between known heights evenly; what lies before the first and after the last is left off.
std::vector<double> without_gaps(const std::vector<std::optional<double>>& heights, std::size_t& first) {
  std::vector<double> filled;
  std::size_t last = 0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (!heights[i]) continue;
    if (filled.empty())
      first = i;
    else
      for (std::size_t k = last + 1; k < i; ++k)
        filled.push_back(*heights[last] + (*heights[i] - *heights[last]) * static_cast<double>(k - last) /
                                              static_cast<double>(i - last));
    filled.push_back(*heights[i]);
    last = i;
  }
  return filled;
}

std::vector<double> smoothed(const std::vector<double>& heights) {
  const auto half = static_cast<std::ptrdiff_t>(std::lround(body / 2 / key_step));
  const auto count = static_cast<std::ptrdiff_t>(heights.size());
  std::vector<double> means;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const auto from = std::max<std::ptrdiff_t>(i - half, 0);
    const auto to = std::min(i + half + 1, count);
    double sum = 0;
    for (auto k = from; k < to; ++k) sum += heights[k];
    means.push_back(sum / static_cast<double>(to - from));
  }
  return means;
}

/// Where the eye is along a lane from `start`; empty if no ground is under it.
std::vector<Eigen::Vector3d> eyes(const Ground& ground, const Eigen::Vector2d& start,
                                  const Eigen::Vector2d& forward, double length, double height) {
  std::vector<Eigen::Vector2d> places;
  std::vector<std::optional<double>> under;
  for (double s = 0; s <= length; s += key_step) {
    places.emplace_back(start + s * forward);
    const auto heights = ground.within(places.back(), leg);
    under.push_back(heights.empty() ? std::nullopt : std::optional(heights[heights.size() / 2]));
  }
  std::size_t first = 0;
  const auto carried = smoothed(without_gaps(under, first));
  std::vector<Eigen::Vector3d> path;
  for (std::size_t i = 0; i < carried.size(); ++i) {
    const Eigen::Vector2d& p = places[first + i];
    const auto near = ground.within(p, clearance);
    const double z = std::max(carried[i] + height, near.empty() ? carried[i] : near.back() + clearance);
    path.emplace_back(p.x(), p.y(), z);
  }
  return path;
}

}  // namespace

std::vector<View> walk_over(const TriangleMesh& mesh, Random random) {
  Eigen::AlignedBox3d box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex);
  const Ground ground(mesh, box);
  const double height = random.uniform(0.5, 0.6);
  const double pitch_rad = random.uniform(30, 40) * std::numbers::pi / 180;

  const int along = box.sizes().x() >= box.sizes().y() ? 0 : 1;
  const double length = box.sizes()[along];
  const double width = box.sizes()[1 - along];
  const Eigen::Vector2d forward = Eigen::Vector2d::Unit(along);
  const int lanes = std::max(1, static_cast<int>(std::ceil(width / lane_width)));
  std::vector<View> path;
  for (int lane = 0; lane < lanes && path.size() < most_keys; ++lane) {
    const double sway = random.uniform(-most_sway, most_sway) * std::min(1.0, width / lane_width);
    Eigen::Vector2d start = box.min().head<2>();
    start[1 - along] += (lane + 0.5) * width / lanes + sway;
    auto way = eyes(ground, start, forward, length, height);
    for (const double toward : {1.0, -1.0}) {
      for (const auto& eye : way) {
        Eigen::Vector3d look(0, 0, -std::sin(pitch_rad));
        look.head<2>() = toward * std::cos(pitch_rad) * forward;
        path.push_back({eye, eye + look});
      }
      std::reverse(way.begin(), way.end());
    }
  }
  if (path.empty())
    throw Error(Error::Kind::data, "mesh", "has no ground to walk on", "name the axis that is up with --up");
  return path;
}

}  // namespace octosurf::simulation
