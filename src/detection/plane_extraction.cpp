#include "detection/plane_extraction.hpp"

#include "detection/ransac.hpp"
#include "detection/region_points.hpp"
#include "geometry/planarity.hpp"
#include "surfaces/criteria/parts.hpp"
#include "surfaces/criteria/soundness.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

namespace octosurf::detection {
namespace {

constexpr std::size_t scored_points = 2000;  // a sample this large ranks hypotheses as well as all
constexpr float cos_15_deg = 0.9659258F;
constexpr double largest_scatter = 1.7;

}  // namespace

PlaneExtraction::PlaneExtraction(const surfaces::MapView& map, std::vector<Index> region)
    : map_(map),
      parameters_(map.parameters),
      min_points_(static_cast<std::size_t>(parameters_.min_surface_points())),
      robust_(parameters_.aligned()),
      cos_aligned_(robust_ ? static_cast<float>(std::cos(parameters_.detection.aligned_angle)) : -1),
      region_(std::move(region)) {}

std::vector<PlaneExtraction::Index> PlaneExtraction::inliers_of(std::span<const Index> region,
                                                                const RegionPoints& points,
                                                                const Plane& plane) {
  std::vector<Index> inliers;
  points.for_each(plane, [&](std::size_t k, bool belongs) {
    if (belongs) inliers.push_back(region[k]);
  });
  return inliers;
}

std::optional<Plane> PlaneExtraction::best_plane(std::span<const Index> points, const RegionPoints& all) {
  std::mt19937_64 rng(geometry::PackedKeyHash()(map_.window[points.front()].key.packed()) ^ points.size());
  std::optional<RegionPoints> some;
  if (const std::size_t stride = points.size() / scored_points + 1; stride > 1)
    some.emplace(map_, points, stride, cos_aligned_);
  const RegionPoints& sample = some ? *some : all;
  const auto pick = [&] { return points[rng() % points.size()]; };
  const auto position = [&](Index i) { return Eigen::Vector3d(map_.window[i].position.cast<double>()); };
  const auto draw = [&]() -> std::optional<Plane> {
    const Index first = pick();
    const Eigen::Vector3d a = position(first), b = position(pick()), c = position(pick());
    const Eigen::Vector3d cross = (b - a).cross(c - a);
    if (cross.norm() < 1e-9 + 1e-3 * (b - a).norm() * (c - a).norm()) return {};  // collinear
    Plane plane{cross.normalized(), 0};
    if (plane.normal.cast<float>().dot(map_.window[first].view) < 0) plane.normal = -plane.normal;
    plane.offset = plane.normal.dot(a);
    return plane;
  };
  const auto best = ransac<Plane>(
      {.iterations = parameters_.detection.ransac_iterations, .drawn = 3, .scored = sample.size()}, draw,
      [&](const Plane& plane, std::size_t to_beat) { return sample.count(plane, to_beat); });
  if (!best || best->inliers < 3) return {};
  return best->model;
}

std::optional<surfaces::Refusal> PlaneExtraction::refusal_by_width(std::span<const Index> cluster,
                                                                   const Plane& plane) {
  const Eigen::Vector3d reference = map_.window[cluster.front()].position.cast<double>();
  geometry::Moments moments;
  for (const Index i : cluster) moments.add(map_.window[i].position.cast<double>() - reference);
  const double width = geometry::width_of(moments);
  const double min_width = parameters_.surfaces.min_surface_width;
  if (width < min_width) return surfaces::Refusal{Reason::too_narrow, width, min_width};
  // Beside the widest facet of a pillar there are narrower ones that look flat, and so do the strips into
  // which the inliers of its plane are divided.
  constexpr double wider_than_facets = 0.2, wider_than_strips = 0.1;  // m
  const double facets = cluster_bends_ ? wider_than_facets : plane_bends_ ? wider_than_strips : 0;
  if (width < facets) return surfaces::Refusal{Reason::bent};
  return surfaces::narrow_strips(map_, cluster, plane, min_width);
}

geometry::Planarity PlaneExtraction::planarity_of(std::span<const Index> cluster, const Plane& plane) {
  const surfaces::SurfaceModel frame(0, plane, map_.window[cluster.front()].position.cast<double>(), 1.0);
  const sensing::NoiseModel& noise = map_.noise;
  geometry::Planarity planarity(frame.pose());
  for (const Index i : cluster) {
    const occupancy::VoxelPoint& p = map_.window[i];
    planarity.add(p.position, noise.sigma(p.range_class), noise.tolerance(p.range_class),
                  map_.normals.at(i).flat);
  }
  return planarity;
}

/// Rays that an edge parts give readings anywhere between the edge and what lies behind it. They fill the
/// plane that the edge and the line of sight span, and are seen along it. Where a view is nearer to the plane
/// than it is known, its reading lies as well on that plane as before it.
std::optional<surfaces::Refusal> PlaneExtraction::refusal_by_view(std::span<const Index> cluster,
                                                                  const Plane& plane) {
  const auto before = std::count_if(cluster.begin(), cluster.end(), [&](Index i) {
    return plane.normal.dot(map_.window[i].view.cast<double>()) > sensing::NoiseModel::least_facing;
  });
  const double share = static_cast<double>(before) / static_cast<double>(cluster.size());
  constexpr double half = 0.5;
  if (share > half) return {};
  return surfaces::Refusal{Reason::seen_edge_on, share, half};
}

/// A cluster passes if it scatters as noise does, does not bend, most of its points' own normals agree with
/// the plane, most were seen from before it, and it is not the noise of a surface beside it. One that was
/// seen only from far needs more points, because noise makes small planes out of anything.
PlaneExtraction::Verdict PlaneExtraction::verdict_on_shape(std::span<const Index> cluster,
                                                           const Plane& plane) {
  const geometry::Planarity planarity = planarity_of(cluster, plane);
  const auto agreeing = static_cast<std::size_t>(std::count_if(cluster.begin(), cluster.end(), [&](Index i) {
    return map_.normals.at(i).normal.dot(plane.normal.cast<float>()) > cos_15_deg;
  }));
  if (planarity.bends()) return {surfaces::Refusal{Reason::bent}, true};
  if (!(planarity.scatter() <= largest_scatter))
    return {surfaces::Refusal{Reason::scattered, planarity.scatter(), largest_scatter}};
  // The square root, because a laser leaves few readings on a strip: in proportion, strips would be lost.
  const double required_factor = std::sqrt(planarity.mean_tolerance() / parameters_.surface_tolerance());
  const auto points = static_cast<double>(cluster.size());
  if (points < static_cast<double>(min_points_) * required_factor)
    return {surfaces::Refusal{Reason::too_few_for_range, points,
                              static_cast<double>(min_points_) * required_factor}};
  if (agreeing * 10 <= cluster.size() * 6)
    return {surfaces::Refusal{Reason::normals_disagree, static_cast<double>(agreeing) / points, 0.6}};
  if (const std::optional<surfaces::Refusal> refusal = refusal_by_view(cluster, plane)) return {refusal};
  if (const SurfaceId neighbour = surfaces::noise_sheet_over(map_, cluster, plane, 0); neighbour != 0)
    return {surfaces::Refusal{.reason = Reason::noise_sheet, .surface = neighbour}};
  return {};
}

PlaneProposal PlaneExtraction::judged(std::vector<Index> cluster) {
  if (cluster.size() < min_points_) {
    const surfaces::Refusal why =
        surfaces::fewer_than_n(surfaces::few::in_cluster, cluster.size(), min_points_);
    return {plane_, std::move(cluster), why};
  }
  const Plane plane = surfaces::fitted(map_, cluster, plane_);
  std::optional<surfaces::Refusal> refusal = refusal_by_width(cluster, plane);
  if (!refusal && robust_) {
    const Verdict verdict = verdict_on_shape(cluster, plane);
    cluster_bends_ |= verdict.bends;
    refusal = verdict.refusal;
  }
  return {plane, std::move(cluster), refusal};
}

/// Takes the next plane's inliers out of the region, as clusters. If there is no further plane, returns all
/// that is left as one refused proposal.
std::optional<PlaneProposal> PlaneExtraction::divide() {
  const auto all_refused = [&](const surfaces::Refusal& why) {
    return PlaneProposal{plane_, std::exchange(region_, {}), why};
  };
  if (region_.size() < min_points_)
    return all_refused(surfaces::fewer_than_n(surfaces::few::left_over, region_.size(), min_points_));
  const RegionPoints points(map_, region_, 1, cos_aligned_);
  const std::optional<Plane> best = best_plane(region_, points);
  if (!best) return all_refused({.reason = Reason::too_few_points, .what = surfaces::few::off_a_line});
  plane_ = *best;
  std::vector<Index> inliers = inliers_of(region_, points, plane_);
  for (int round = 0; round < 3 && inliers.size() >= min_points_; ++round) {
    plane_ = surfaces::fitted(map_, inliers, plane_);
    inliers = inliers_of(region_, points, plane_);
  }
  if (inliers.size() < min_points_)
    return all_refused(surfaces::fewer_than_n(surfaces::few::on_plane, inliers.size(), min_points_));
  clusters_ = surfaces::parts_of(map_, inliers, plane_);
  std::reverse(clusters_.begin(), clusters_.end());
  plane_bends_ = robust_ && clusters_.size() > 1 && planarity_of(inliers, plane_).bends();
  std::vector<Index> rest;
  points.for_each(plane_, [&](std::size_t k, bool belongs) {
    if (!belongs) rest.push_back(region_[k]);
  });
  region_ = std::move(rest);
  return {};
}

std::optional<PlaneProposal> PlaneExtraction::next() {
  while (clusters_.empty()) {
    if (region_.empty()) return {};
    if (std::optional<PlaneProposal> refused = divide()) return refused;
  }
  std::vector<Index> cluster = std::move(clusters_.back());
  clusters_.pop_back();
  return judged(std::move(cluster));
}

}  // namespace octosurf::detection
