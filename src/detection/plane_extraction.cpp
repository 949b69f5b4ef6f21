#include "detection/plane_extraction.hpp"

#include "detection/region_points.hpp"
#include "surfaces/planarity.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tsl/robin_map.h>

namespace octosurf {
namespace {

constexpr std::size_t scored_points = 2000;  // a sample this large ranks hypotheses as well as all
constexpr double confidence = 0.999;
constexpr float cos_15_deg = 0.9659258F;
constexpr double largest_scatter = 1.7;

}  // namespace

PlaneExtraction::PlaneExtraction(Workspace& work, const Parameters& parameters, const RefusalSink* refusals)
    : work_(work),
      parameters_(parameters),
      fewest_(static_cast<std::size_t>(parameters.min_surface_points())),
      aligned_(parameters.aligned()),
      cos_aligned_(aligned_ ? static_cast<float>(std::cos(parameters.detection.aligned_angle)) : -1),
      refusals_(refusals) {}

bool PlaneExtraction::refuse(Refusal why, std::span<const Index> points, double measured, double limit,
                             SurfaceId surface) const {
  if (refusals_ != nullptr) (*refusals_)({why, points, measured, limit, surface});
  return false;
}

bool PlaneExtraction::too_few(Refusal why, std::span<const Index> points, std::size_t count) const {
  return count < fewest_ && !refuse(why, points, static_cast<double>(count), static_cast<double>(fewest_));
}

std::vector<PlaneExtraction::Index> PlaneExtraction::inliers_of(std::span<const Index> region,
                                                                const RegionPoints& points,
                                                                const Plane& plane) {
  std::vector<Index> inliers;
  points.for_each(plane, [&](std::size_t k, bool belongs) {
    if (belongs) inliers.push_back(region[k]);
  });
  return inliers;
}

bool PlaneExtraction::ransac(std::span<const Index> points, Plane& best) {
  std::mt19937_64 rng(PackedKeyHash()(work_.window[points.front()].key.packed()) ^ points.size());
  const RegionPoints sample(work_, points, points.size() / scored_points + 1, cos_aligned_);
  const auto pick = [&] { return points[rng() % points.size()]; };
  const auto position = [&](Index i) { return Eigen::Vector3d(work_.window[i].position.cast<double>()); };

  std::size_t most = 0;
  double needed = parameters_.detection.ransac_iterations;
  for (int k = 0; k < parameters_.detection.ransac_iterations && k < needed; ++k) {
    const Index first = pick();
    const Eigen::Vector3d a = position(first), b = position(pick()), c = position(pick());
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    if (cross.norm() < 1e-9 + 1e-3 * (b - a).norm() * (c - a).norm()) continue;  // collinear
    Plane plane{cross.normalized(), 0};
    if (plane.normal.cast<float>().dot(work_.window[first].view) < 0) plane.normal = -plane.normal;
    plane.offset = plane.normal.dot(a);
    const std::size_t inliers = sample.count(plane, most);
    if (inliers <= most) continue;
    most = inliers;
    best = plane;
    const double share = static_cast<double>(most) / static_cast<double>(sample.size());
    const double all_good = std::min(share * share * share, 1 - 1e-9);
    needed = std::log(1 - confidence) / std::log(1 - all_good);
  }
  return most >= 3;
}

Plane PlaneExtraction::fit(std::span<const Index> points, const Plane& toward) {
  const Eigen::Vector3d reference = work_.window[points.front()].position.cast<double>();
  Moments moments;
  for (const Index i : points) {
    const double sigma = std::max(work_.state.noise.sigma(work_.window[i].range_class), 1e-6);
    moments.add(work_.window[i].position.cast<double>() - reference, 1e-6 / (sigma * sigma));
  }
  const PlaneFit f = fit_plane(moments);
  Plane plane{f.normal, 0};
  if (plane.normal.dot(toward.normal) < 0) plane.normal = -plane.normal;
  plane.offset = plane.normal.dot(reference + f.centroid);
  return plane;
}

std::vector<std::vector<PlaneExtraction::Index>> PlaneExtraction::clusters(std::span<const Index> points,
                                                                           const Plane& plane) {
  const double d = parameters_.occupancy.resolution;
  const SurfaceModel frame(0, plane, work_.window[points.front()].position.cast<double>(), d);
  std::map<std::pair<int, int>, std::vector<Index>> cells;
  for (const Index i : points) {
    const PlaneCell cell = frame.cell_of(work_.window[i].position);
    cells[{cell.v, cell.u}].push_back(i);
  }
  const int reach = std::max(1, static_cast<int>(parameters_.max_hole_size() / d));
  std::vector<std::vector<Index>> result;
  while (!cells.empty()) {
    std::vector<Index>& cluster = result.emplace_back();
    std::vector<std::pair<int, int>> open{cells.begin()->first};
    cluster = std::move(cells.begin()->second);
    cells.erase(cells.begin());
    while (!open.empty()) {
      const auto [v0, u0] = open.back();
      open.pop_back();
      for (int v = v0 - reach; v <= v0 + reach; ++v)
        for (auto it = cells.lower_bound({v, u0 - reach});
             it != cells.end() && it->first <= std::pair(v, u0 + reach);) {
          open.push_back(it->first);
          cluster.insert(cluster.end(), it->second.begin(), it->second.end());
          it = cells.erase(it);
        }
    }
  }
  return result;
}

bool PlaneExtraction::wide_enough(std::span<const Index> cluster) {
  const Eigen::Vector3d reference = work_.window[cluster.front()].position.cast<double>();
  Moments moments;
  for (const Index i : cluster) moments.add(work_.window[i].position.cast<double>() - reference);
  // A uniform strip of width w has a variance of w²/12 across.
  const double width = std::sqrt(12 * fit_plane(moments).variances[1]);
  const double least = parameters_.surfaces.min_surface_width;
  return width >= least || refuse(Refusal::narrow, cluster, width, least);
}

/// Scatters as noise does, is flat, and its points' own normals mostly agree with it. What was only
/// seen from far needs more points: noise makes small planes out of anything.
bool PlaneExtraction::planar(std::span<const Index> cluster, const Plane& plane, bool& bent) {
  const SurfaceModel frame(0, plane, work_.window[cluster.front()].position.cast<double>(), 1.0);
  const NoiseModel& noise = work_.state.noise;
  Planarity planarity(frame.pose());
  std::size_t agreeing = 0;
  for (const Index i : cluster) {
    const VoxelPoint& p = work_.window[i];
    const LocalPlane& local = work_.normals.at(i);
    planarity.add(p.position, noise.sigma(p.range_class), noise.tolerance(p.range_class), local.flat);
    agreeing += local.normal.dot(plane.normal.cast<float>()) > cos_15_deg;
  }
  if (planarity.bends()) {
    bent = true;
    return refuse(Refusal::bent, cluster);
  }
  const double effort = planarity.mean_tolerance() / parameters_.surface_tolerance();
  const auto points = static_cast<double>(cluster.size());
  if (!(planarity.scatter() <= largest_scatter))
    return refuse(Refusal::scattered, cluster, planarity.scatter(), largest_scatter);
  if (points < static_cast<double>(fewest_) * effort)
    return refuse(Refusal::few_for_range, cluster, points, static_cast<double>(fewest_) * effort);
  return agreeing * 10 > cluster.size() * 6 ||
         refuse(Refusal::normals_disagree, cluster, static_cast<double>(agreeing) / points, 0.6);
}

/// Noise of a wall lies in front of or behind it as a parallel sheet; one that is mostly over a
/// larger surface and within the reach of its noise is no surface of its own.
SurfaceId PlaneExtraction::sheet_of_neighbour(std::span<const Index> cluster, const Plane& plane) {
  std::map<SurfaceId, std::size_t> over;
  for (const Index i : cluster) {
    const VoxelPoint& p = work_.window[i];
    for (const SurfaceId id : work_.state.surfaces.near(p.key, 2)) {
      const SurfaceModel& surface = *work_.state.surfaces.find(id);
      if (surface.size() <= cluster.size() || surface.plane().normal.dot(plane.normal) < 0.9) continue;
      if (std::fabs(surface.distance(p.position)) <= 1.3 * work_.state.noise.tolerance(p.range_class) &&
          surface.covers(surface.cell_of(p.position)))
        ++over[id];
    }
  }
  const auto found = std::find_if(over.begin(), over.end(),
                                  [&](const auto& entry) { return entry.second * 10 > cluster.size() * 6; });
  return found == over.end() ? 0 : found->first;
}

bool PlaneExtraction::acceptable(std::span<const Index> cluster, const Plane& plane, bool& bent) {
  if (!wide_enough(cluster)) return false;
  if (!aligned_) return true;
  if (!planar(cluster, plane, bent)) return false;
  const SurfaceId neighbour = sheet_of_neighbour(cluster, plane);
  return neighbour == 0 || refuse(Refusal::noise_sheet, cluster, 0, 0, neighbour);
}

std::vector<SurfaceId> PlaneExtraction::operator()(std::vector<Index> region) {
  std::vector<SurfaceId> born;
  while (region.size() >= fewest_) {
    Plane plane;
    if (!ransac(region, plane)) {
      refuse(Refusal::no_plane, region);
      break;
    }
    const RegionPoints points(work_, region, 1, cos_aligned_);
    std::vector<Index> inliers = inliers_of(region, points, plane);
    for (int round = 0; round < 3 && inliers.size() >= fewest_; ++round) {
      plane = fit(inliers, plane);
      inliers = inliers_of(region, points, plane);
    }
    if (too_few(Refusal::few_on_plane, region, inliers.size())) break;
    bool bent = false;
    for (const std::vector<Index>& cluster : clusters(inliers, plane)) {
      if (too_few(Refusal::small_cluster, cluster, cluster.size())) continue;
      const Plane own = fit(cluster, plane);
      if (!acceptable(cluster, own, bent)) continue;
      SurfaceModel& surface =
          work_.state.surfaces.create(own, work_.window[cluster.front()].position.cast<double>());
      for (const Index i : cluster) work_.give(i, surface);
      work_.changes.born.insert(surface.id());
      born.push_back(surface.id());
    }
    // What is left beside a pillar's widest facet are narrower ones, which look flat.
    if (bent) {
      refuse(Refusal::bent, region);
      break;
    }
    std::vector<Index> rest;
    points.for_each(plane, [&](std::size_t k, bool belongs) {
      if (!belongs) rest.push_back(region[k]);
    });
    region = std::move(rest);
  }
  too_few(Refusal::few_left, region, region.size());
  return born;
}

}  // namespace octosurf
