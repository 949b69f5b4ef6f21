#include "pcl/paper_detector.hpp"

#include "geometry/even_odd.hpp"
#include "pcl/steps.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <octosurf/adapters/paper_detector.hpp>

namespace octosurf::pcl {
namespace {

using detection::Assignment;
using detection::Proposal;
using geometry::VoxelKey;
using surfaces::MapView;
using surfaces::SurfaceModel;

std::size_t least_points(const Parameters& parameters) {
  return static_cast<std::size_t>(parameters.min_surface_points());
}

/// The elements of `from` at these indices.
template <class Element>
std::vector<Element> at(const std::vector<Element>& from, const Indices& places) {
  std::vector<Element> picked;
  picked.reserve(places.size());
  for (const std::uint32_t i : places) picked.push_back(from[i]);
  return picked;
}

/// `all` without those at `places`, which are ascending.
Indices without(const Indices& all, const Indices& places) {
  Indices rest;
  for (std::uint32_t i = 0; i < all.size(); ++i)
    if (!std::binary_search(places.begin(), places.end(), i)) rest.push_back(all[i]);
  return rest;
}

Points positions(const MapView& map, std::span<const PointId> points) {
  Points positions;
  positions.reserve(points.size());
  for (const PointId i : points) positions.push_back(map.window[i].position);
  return positions;
}

std::vector<const SurfaceModel*> by_size(const MapView& map, const std::set<SurfaceId>& ids) {
  std::vector<const SurfaceModel*> surfaces;
  for (const SurfaceId id : ids) surfaces.push_back(map.surfaces.find(id));
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const SurfaceModel* a, const SurfaceModel* b) { return a->size() > b->size(); });
  return surfaces;
}

/// Largest first, surfaces that may take one of these points: their inliers are up to s off the plane and h
/// in it.
std::vector<const SurfaceModel*> surfaces_near(const MapView& map, std::span<const PointId> points) {
  const Parameters& p = map.parameters;
  const double reach = std::ceil((p.surface_tolerance() + p.max_hole_size()) / map.grid.resolution());
  std::set<SurfaceId> ids;
  if (reach > 64) {  // looking up each block would take longer than scanning the surfaces
    for (const auto& [id, surface] : map.surfaces) ids.insert(id);
    return by_size(map, ids);
  }
  for (const PointId i : points)
    for (const SurfaceId id : map.surfaces.near(map.window[i].key, static_cast<int>(reach))) ids.insert(id);
  return by_size(map, ids);
}

bool inside(const std::vector<Polygon>& polygons, const Eigen::Vector2d& p) {
  bool odd = false;
  for (const Polygon& polygon : polygons) {
    odd ^= geometry::inside(polygon.outer, p);
    for (const Ring2& hole : polygon.holes) odd ^= geometry::inside(hole, p);
  }
  return odd;
}

/// The inliers at vertices of the outline, which lie on a lattice (geometry::Outline::quantum).
Points boundary(const SurfaceModel& surface) {
  const auto place = [](const Eigen::Vector2d& p) {
    const Eigen::Vector2d steps = p / geometry::Outline::quantum;
    return std::pair(std::llround(steps.x()), std::llround(steps.y()));
  };
  std::vector<std::pair<long long, long long>> vertices;
  const Eigen::Affine2d T_outline_surface = surface.T_surface_outline().inverse();
  const auto add = [&](const Ring2& ring) {
    for (const Eigen::Vector2d& p : ring) vertices.push_back(place(T_outline_surface * p));
  };
  for (const Polygon& polygon : surface.polygons()) {
    add(polygon.outer);
    for (const Ring2& hole : polygon.holes) add(hole);
  }
  std::sort(vertices.begin(), vertices.end());
  Points points;
  for (const surfaces::Inlier& inlier : surface.sorted_inliers())
    if (std::binary_search(vertices.begin(), vertices.end(), place(surface.outline_point(inlier.position))))
      points.push_back(inlier.position);
  return points;
}

/// Reasons why points are on no plane.
struct Refused {
  surfaces::Refusal why;
  Indices points;
};

/// III-C2 to C4 (Algorithm 2): normals, smooth regions, and for each, while it has more than n points, a
/// plane, whose inliers are split at gaps of more than h. Inliers are indices of the points.
std::vector<PlaneFit> find_planes(const Points& points, const Parameters& parameters,
                                  std::vector<Refused>* refused = nullptr) {
  const std::size_t n = least_points(parameters);
  const double h = parameters.max_hole_size();
  const DetectionParameters& d = parameters.detection;
  const auto refuse_small = [&](const Indices& its) {
    const surfaces::Refusal why{Reason::too_few_points, static_cast<double>(its.size()),
                                static_cast<double>(n + 1)};
    if (refused != nullptr && its.size() <= n) refused->push_back({why, its});
  };
  std::vector<PlaneFit> planes;
  if (points.size() <= n) {
    Indices all(points.size());
    std::iota(all.begin(), all.end(), 0U);
    refuse_small(all);
    return planes;
  }
  const double r = parameters.search_radius();
  const std::vector<PointNormal> normals = mls_normals(points, r);
  Indices with_normal;
  for (const PointNormal& normal : normals) with_normal.push_back(normal.point);
  const Points smoothed = at(points, with_normal);
  if (refused != nullptr)
    for (const Indices& region : smooth_regions(smoothed, normals, r, d.smoothness_angle, d.max_curvature, 1))
      refuse_small(at(with_normal, region));
  for (const Indices& of_region :
       smooth_regions(smoothed, normals, r, d.smoothness_angle, d.max_curvature, n)) {
    Indices region = at(with_normal, of_region);
    while (region.size() > n) {
      const PlaneFit fit = fit_plane(at(points, region), parameters.surface_tolerance(), d.ransac_iterations);
      if (fit.inliers.empty()) break;
      const Indices inliers = at(region, fit.inliers);
      region = without(region, fit.inliers);
      const Points on_plane = at(points, inliers);
      if (refused != nullptr)
        for (const Indices& cluster : clusters(on_plane, h, 1)) refuse_small(at(inliers, cluster));
      for (const Indices& cluster : clusters(on_plane, h, n + 1))
        planes.push_back({fit.plane, at(inliers, cluster)});
    }
    refuse_small(region);
  }
  return planes;
}

/// For the points that a surface takes; 0: none.
std::vector<Assignment> assignments(std::span<const PointId> points, const std::vector<SurfaceId>& taken_by) {
  std::vector<Assignment> taken;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (taken_by[k] != 0) taken.push_back({points[k], taken_by[k]});
  return taken;
}

/// Planes of `points`, which are in key order.
Proposal proposal_of(const MapView& map, std::span<const PointId> points) {
  Proposal proposal;
  proposal.unprocessed.assign(points.begin(), points.end());
  for (const PointId i : points) proposal.points.push_back({i, 0});
  for (const PlaneFit& fit : find_planes(positions(map, points), map.parameters)) {
    Proposal::FoundPlane found{.plane = fit.plane};
    Eigen::Vector3d toward_sensor = Eigen::Vector3d::Zero();
    for (const std::uint32_t k : fit.inliers) {
      proposal.points[k].label = static_cast<Proposal::Label>(proposal.planes.size());
      found.centroid +=
          map.window[points[k]].position.cast<double>() / static_cast<double>(fit.inliers.size());
      toward_sensor += map.window[points[k]].view.cast<double>();
    }
    if (fit.plane.normal.dot(toward_sensor) < 0) found.plane = {-fit.plane.normal, -fit.plane.offset};
    proposal.planes.push_back(found);
  }
  return proposal;
}

/// Without points that have too few neighbours, see PaperDetector on III-C1.
std::vector<PointId> filtered(const MapView& map, const std::vector<PointId>& points) {
  return at(points, with_neighbors(positions(map, points), map.parameters.search_radius(), 2));
}

}  // namespace

std::vector<Assignment> PaperDetector::add_inliers(const MapView& map, std::span<const PointId> fresh) const {
  const double s = map.parameters.surface_tolerance();
  const Points points = positions(map, fresh);
  std::vector<SurfaceId> inside_of(fresh.size(), 0);
  for (const SurfaceModel* surface : surfaces_near(map, fresh)) {
    const Eigen::Isometry3d T_surface_map = surface->pose().inverse();
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (inside_of[k] != 0 || std::fabs(surface->distance(points[k])) > s) continue;
      const Eigen::Vector3d in_frame = T_surface_map * points[k].cast<double>();
      if (inside(surface->polygons(), in_frame.head<2>())) inside_of[k] = surface->id();
    }
  }
  return assignments(fresh, inside_of);
}

std::vector<Assignment> PaperDetector::expand(const MapView& map, std::span<const PointId> left) const {
  const std::vector<const SurfaceModel*> surfaces = surfaces_near(map, left);
  if (surfaces.empty()) return {};
  const double s = map.parameters.surface_tolerance(), h = map.parameters.max_hole_size();
  const Points points = positions(map, left);
  RadiusSearch near(points);
  std::vector<SurfaceId> taken(left.size(), 0);
  for (const SurfaceModel* surface : surfaces) {
    Points frontier = boundary(*surface);
    for (std::size_t next = 0; next < frontier.size(); ++next)
      for (const std::uint32_t j : near.within(frontier[next], h)) {
        if (taken[j] != 0 || std::fabs(surface->distance(points[j])) > s) continue;
        taken[j] = surface->id();
        frontier.push_back(points[j]);
      }
  }
  return assignments(left, taken);
}

detection::Due PaperDetector::due(const MapView& map, const surfaces::PendingQueue& queue,
                                  std::span<const PointId> fresh,
                                  std::optional<std::uint64_t> /*turn*/) const {
  std::vector<PointId> waits(fresh.begin(), fresh.end());
  for (const VoxelKey key : queue.fresh)
    if (const PointId i = map.window.find(key); map.is_pending(i)) waits.push_back(i);
  map.window.put_in_order(waits);
  std::erase_if(waits, [&](PointId i) { return map.window[i].surface != 0; });
  waits = filtered(map, waits);
  detection::Due due;
  if (waits.size() > least_points(map.parameters))
    due.points = std::move(waits);
  else
    for (const PointId i : waits) due.left.fresh.push_back(map.window[i].key);
  return due;
}

std::optional<Proposal> PaperDetector::segment(const MapView& map, const detection::Part& part) const {
  if (!part.all) return part.points.empty() ? std::nullopt : std::optional(proposal_of(map, part.points));
  std::vector<PointId> all;
  map.octree.for_each_point([&](const occupancy::VoxelPoint& p) { all.push_back(map.window.find(p.key)); });
  map.window.put_in_order(all);
  const std::vector<PointId> kept = filtered(map, all);
  Proposal proposal = proposal_of(map, kept);
  const occupancy::PointSet labelled(kept);
  for (const PointId i : all)
    if (!labelled.contains(i)) proposal.points.push_back({i, 0});
  return proposal;
}

std::map<PointId, surfaces::Refusal> PaperDetector::refusals(const MapView& map,
                                                             std::span<const PointId> pending) const {
  std::map<PointId, surfaces::Refusal> reasons;
  for (const PointId i : pending) reasons[i] = {Reason::isolated};
  const std::vector<PointId> kept = filtered(map, {pending.begin(), pending.end()});
  for (const PointId i : kept) reasons[i] = {Reason::no_plane};
  std::vector<Refused> refused;
  const std::vector<PlaneFit> planes = find_planes(positions(map, kept), map.parameters, &refused);
  for (const Refused& few : refused)
    for (const std::uint32_t i : few.points) reasons[kept[i]] = few.why;
  for (const PlaneFit& plane : planes)
    for (const std::uint32_t i : plane.inliers) reasons[kept[i]] = {Reason::waiting};
  return reasons;
}

}  // namespace octosurf::pcl

namespace octosurf {

const detection::Detector* paper_detector() {
  static const pcl::PaperDetector detector;
  return &detector;
}

}  // namespace octosurf
