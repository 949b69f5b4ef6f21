#include "detection/plane_extraction.hpp"

#include "detection/region_points.hpp"
#include "surfaces/parts.hpp"
#include "surfaces/planarity.hpp"
#include "surfaces/soundness.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

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

bool PlaneExtraction::refuse(const Refusal& why, std::span<const Index> points) const {
  if (refusals_ != nullptr) (*refusals_)({why, points});
  return false;
}

bool PlaneExtraction::too_few(std::string_view what, std::span<const Index> points, std::size_t count) const {
  return count < fewest_ && !refuse(fewer_than_n(what, count, fewest_), points);
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

bool PlaneExtraction::ransac(std::span<const Index> points, const RegionPoints& all, Plane& best) {
  std::mt19937_64 rng(PackedKeyHash()(work_.window[points.front()].key.packed()) ^ points.size());
  std::optional<RegionPoints> some;
  if (const std::size_t stride = points.size() / scored_points + 1; stride > 1)
    some.emplace(work_, points, stride, cos_aligned_);
  const RegionPoints& sample = some ? *some : all;
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

bool PlaneExtraction::wide_enough(std::span<const Index> cluster, bool bent) {
  const Eigen::Vector3d reference = work_.window[cluster.front()].position.cast<double>();
  Moments moments;
  for (const Index i : cluster) moments.add(work_.window[i].position.cast<double>() - reference);
  const double width = width_of(moments);
  const double least = parameters_.surfaces.min_surface_width;
  if (width < least) return refuse({Reason::too_narrow, width, least}, cluster);
  // What is left beside a pillar's widest facet are narrower ones, which look flat; so do the strips that
  // its inliers fall into.
  constexpr double wider_than_facets = 0.2, wider_than_strips = 0.1;  // m
  const double facets = bent ? wider_than_facets : curved_ ? wider_than_strips : 0;
  return width >= facets || refuse({Reason::bent}, cluster);
}

Planarity PlaneExtraction::planarity_of(std::span<const Index> cluster, const Plane& plane) {
  const SurfaceModel frame(0, plane, work_.window[cluster.front()].position.cast<double>(), 1.0);
  const NoiseModel& noise = work_.state.noise;
  Planarity planarity(frame.pose());
  for (const Index i : cluster) {
    const VoxelPoint& p = work_.window[i];
    planarity.add(p.position, noise.sigma(p.range_class), noise.tolerance(p.range_class),
                  work_.normals.at(i).flat);
  }
  return planarity;
}

/// Scatters as noise does, is flat, and its points' own normals mostly agree with it. What was only
/// seen from far needs more points: noise makes small planes out of anything.
bool PlaneExtraction::planar(std::span<const Index> cluster, const Plane& plane, bool& bent) {
  const Planarity planarity = planarity_of(cluster, plane);
  const auto agreeing = static_cast<std::size_t>(std::count_if(cluster.begin(), cluster.end(), [&](Index i) {
    return work_.normals.at(i).normal.dot(plane.normal.cast<float>()) > cos_15_deg;
  }));
  if (planarity.bends()) {
    bent = true;
    return refuse({Reason::bent}, cluster);
  }
  // As the root: a laser leaves few readings on a strip, and asking for more in proportion loses it.
  const double effort = std::sqrt(planarity.mean_tolerance() / parameters_.surface_tolerance());
  const auto points = static_cast<double>(cluster.size());
  if (!(planarity.scatter() <= largest_scatter))
    return refuse({Reason::scattered, planarity.scatter(), largest_scatter}, cluster);
  if (points < static_cast<double>(fewest_) * effort)
    return refuse({Reason::too_few_for_range, points, static_cast<double>(fewest_) * effort}, cluster);
  return agreeing * 10 > cluster.size() * 6 ||
         refuse({Reason::normals_disagree, static_cast<double>(agreeing) / points, 0.6}, cluster);
}

bool PlaneExtraction::acceptable(std::span<const Index> cluster, const Plane& plane, bool& bent) {
  if (!wide_enough(cluster, bent)) return false;
  if (!aligned_) return true;
  if (!planar(cluster, plane, bent)) return false;
  const SurfaceId neighbour = parallel_sheet(work_, cluster, plane, 0);
  return neighbour == 0 || refuse({.reason = Reason::noise_sheet, .surface = neighbour}, cluster);
}

void PlaneExtraction::make_surface(std::span<const Index> cluster, const Plane& plane,
                                   std::vector<SurfaceId>& born, bool& bent) {
  if (!acceptable(cluster, plane, bent)) return;
  SurfaceModel& surface =
      work_.state.surfaces.create(plane, work_.window[cluster.front()].position.cast<double>());
  for (const Index i : cluster) work_.give(i, surface);
  work_.changes.born.insert(surface.id());
  born.push_back(surface.id());
}

std::vector<SurfaceId> PlaneExtraction::operator()(std::vector<Index> region) {
  std::vector<SurfaceId> born;
  bool bent = false;
  while (region.size() >= fewest_) {
    const RegionPoints points(work_, region, 1, cos_aligned_);
    Plane plane;
    if (!ransac(region, points, plane)) {
      refuse({.reason = Reason::too_few_points, .what = few::off_a_line}, region);
      break;
    }
    std::vector<Index> inliers = inliers_of(region, points, plane);
    for (int round = 0; round < 3 && inliers.size() >= fewest_; ++round) {
      plane = fitted(work_, inliers, plane);
      inliers = inliers_of(region, points, plane);
    }
    if (too_few(few::on_plane, region, inliers.size())) break;
    const std::vector<std::vector<Index>> parts = parts_of(work_, inliers, plane);
    curved_ = aligned_ && parts.size() > 1 && planarity_of(inliers, plane).bends();
    for (const std::vector<Index>& part : parts)
      if (!too_few(few::in_cluster, part, part.size()))
        make_surface(part, fitted(work_, part, plane), born, bent);
    std::vector<Index> rest;
    points.for_each(plane, [&](std::size_t k, bool belongs) {
      if (!belongs) rest.push_back(region[k]);
    });
    region = std::move(rest);
  }
  too_few(few::left_over, region, region.size());
  return born;
}

}  // namespace octosurf
