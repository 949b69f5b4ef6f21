#include "pcl/paper_detector.hpp"

#include "detection/voxel_blocks.hpp"
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
using detection::VoxelBlocks;
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

Points positions(const MapView& map, std::span<const PointId> points) {
  Points positions;
  positions.reserve(points.size());
  for (const PointId i : points) positions.push_back(map.window[i].position);
  return positions;
}

constexpr int block_edge = 8;  // voxels
/// Blocks up to `reach` voxels from one of these points, in order.
std::vector<VoxelBlocks::Place> blocks_near(const MapView& map, std::span<const PointId> points, int reach) {
  const VoxelBlocks blocks(block_edge);
  std::vector<VoxelBlocks::Place> places;
  for (const PointId i : points) places.push_back(blocks.of(map.window[i].key));
  return blocks.widened(std::move(places), reach);
}

/// Largest first, surfaces that may take one of these points: their inliers are up to s off the plane and h
/// in it.
std::vector<const SurfaceModel*> surfaces_near(const MapView& map, std::span<const PointId> points) {
  const double within = map.parameters.surface_tolerance() + map.parameters.max_hole_size();
  const int reach = block_edge + static_cast<int>(std::ceil(within / map.grid.resolution()));
  const bool all = reach > 64;  // looking up each block would take longer
  std::set<SurfaceId> ids;
  if (!all)
    for (const VoxelBlocks::Place place : blocks_near(map, points, 0)) {
      const VoxelKey block = VoxelKey::unpack(block_edge * place);
      for (const SurfaceId id : map.surfaces.near(block, reach)) ids.insert(id);
    }
  std::vector<const SurfaceModel*> near;
  for (const auto& [id, surface] : map.surfaces)
    if (all || ids.contains(id)) near.push_back(&surface);
  std::stable_sort(near.begin(), near.end(),
                   [](const SurfaceModel* a, const SurfaceModel* b) { return a->size() > b->size(); });
  return near;
}

template <class Visit>
void for_each_ring(const SurfaceModel& surface, const Visit& visit) {
  for (const Polygon& polygon : surface.polygons()) {
    visit(polygon.outer);
    for (const Ring2& hole : polygon.holes) visit(hole);
  }
}

/// Calls visit(inlier) for those at vertices of the outline, from the cells of the plane's hash.
template <class Visit>
void for_each_boundary_point(const SurfaceModel& surface, const Visit& visit) {
  constexpr double slack = 1.0 / 64;  // cells: the hash rounds to floats, up to 2¹⁶ cells from its origin
  const Eigen::Affine2d T_outline_surface = surface.T_surface_outline().inverse();
  for_each_ring(surface, [&](const Ring2& ring) {
    for (const Eigen::Vector2d& p : ring) {
      const Eigen::Vector2d vertex = T_outline_surface * p;
      const Eigen::Array2i low = (vertex.array() - slack).floor().cast<int>();
      const Eigen::Array2i high = (vertex.array() + slack).floor().cast<int>();
      for (int v = low.y(); v <= high.y(); ++v)
        for (int u = low.x(); u <= high.x(); ++u)
          surface.inliers().for_each_in({u, v}, [&](const surfaces::Inlier& inlier) {
            if ((surface.outline_point(inlier.position) - vertex).norm() < geometry::Outline::quantum / 2)
              visit(inlier);
          });
    }
  });
}

/// Indices of points.
struct Planes {
  std::vector<PlaneFit> found;
  std::vector<Indices> small;  ///< groups of at most n
};

/// III-C2 to C4 (Algorithm 2): normals, smooth regions, and for each, while it has more than n points, a
/// plane, whose inliers are split at gaps of more than h.
Planes find_planes(const Points& points, const Parameters& parameters) {
  const std::size_t n = least_points(parameters);
  const double r = parameters.search_radius();
  std::vector<Indices> regions(1, Indices(points.size()));
  std::iota(regions[0].begin(), regions[0].end(), 0U);
  if (points.size() > n) regions = smooth_regions(points, mls_normals(points, r), r);
  Planes planes;
  for (Indices& region : regions) {
    while (region.size() > n) {
      const PlaneFit fit = fit_plane(at(points, region), parameters.surface_tolerance());
      if (fit.inliers.empty()) break;
      const Indices inliers = at(region, fit.inliers);
      Indices rest;  // both are ascending
      std::set_difference(region.begin(), region.end(), inliers.begin(), inliers.end(),
                          std::back_inserter(rest));
      region = std::move(rest);
      for (const Indices& of_cluster : clusters(at(points, inliers), parameters.max_hole_size())) {
        const Indices cluster = at(inliers, of_cluster);
        if (cluster.size() > n)
          planes.found.push_back({fit.plane, cluster});
        else
          planes.small.push_back(cluster);
      }
    }
    if (region.size() <= n) planes.small.push_back(region);
  }
  return planes;
}

/// Planes of `points`, which are in key order.
Proposal proposal_of(const MapView& map, std::span<const PointId> points) {
  Proposal proposal;
  proposal.unprocessed.assign(points.begin(), points.end());
  for (const PointId i : points) proposal.points.push_back({i, 0});
  for (const PlaneFit& fit : find_planes(positions(map, points), map.parameters).found) {
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
    Eigen::AlignedBox2d box;
    for_each_ring(*surface, [&](const Ring2& ring) {
      for (const Eigen::Vector2d& p : ring) box.extend(p);
    });
    const auto is_inside = [&](const Eigen::Vector3f& point) {
      if (surface->raster().deep_inside(surface->cell_of(point))) return true;
      const Eigen::Vector2d p = (T_surface_map * point.cast<double>()).head<2>();
      bool odd = false;
      if (box.contains(p))
        for_each_ring(*surface, [&](const Ring2& ring) { odd ^= geometry::inside(ring, p); });
      return odd;
    };
    for (std::size_t k = 0; k < points.size(); ++k)
      if (inside_of[k] == 0 && std::fabs(surface->distance(points[k])) <= s && is_inside(points[k]))
        inside_of[k] = surface->id();
  }
  std::vector<Assignment> taken;
  for (std::size_t k = 0; k < fresh.size(); ++k)
    if (inside_of[k] != 0) taken.push_back({fresh[k], inside_of[k]});
  return taken;
}

std::vector<Assignment> PaperDetector::expand(const MapView& map, std::span<const PointId> fresh, int) const {
  std::vector<PointId> left;
  std::copy_if(fresh.begin(), fresh.end(), std::back_inserter(left),
               [&](PointId i) { return map.is_pending(i); });
  const double s = map.parameters.surface_tolerance(), h = map.parameters.max_hole_size();
  const int reach = static_cast<int>(std::ceil(h / map.grid.resolution()));
  const std::vector<VoxelBlocks::Place> near_cloud = blocks_near(map, left, reach);
  const occupancy::PointSet cloud(left);
  occupancy::PointSet taken;
  std::vector<Assignment> gained;
  for (const SurfaceModel* surface : surfaces_near(map, left)) {
    const auto take_near = [&](VoxelKey key, const Eigen::Vector3f& from) {
      map.window.for_each_near(key, reach, [&](PointId i) {
        if (!cloud.contains(i)) return;
        const Eigen::Vector3f& p = map.window[i].position;
        if ((p - from).norm() <= h && std::fabs(surface->distance(p)) <= s && taken.insert(i))
          gained.push_back({i, surface->id()});
      });
    };
    std::size_t next = gained.size();
    for_each_boundary_point(*surface, [&](const surfaces::Inlier& i) {
      if (std::binary_search(near_cloud.begin(), near_cloud.end(), VoxelBlocks(block_edge).of(i.key)))
        take_near(i.key, i.position);
    });
    for (; next < gained.size(); ++next) {
      const occupancy::VoxelPoint& boundary = map.window[gained[next].point];
      take_near(boundary.key, boundary.position);
    }
  }
  return gained;
}

detection::Due PaperDetector::due(const MapView& map, const surfaces::PendingQueue& queue,
                                  std::span<const PointId> fresh, std::optional<std::uint64_t>) const {
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

std::optional<Proposal> PaperDetector::segment(const MapView& map, const detection::Part& part, int) const {
  return part.points.empty() ? std::nullopt : std::optional(proposal_of(map, part.points));
}

std::map<PointId, surfaces::Refusal> PaperDetector::refusals(const MapView& map,
                                                             std::span<const PointId> pending) const {
  std::map<PointId, surfaces::Refusal> reasons;
  for (const PointId i : pending) reasons[i] = {Reason::isolated};
  const std::vector<PointId> kept = filtered(map, {pending.begin(), pending.end()});
  for (const PointId i : kept) reasons[i] = {Reason::no_plane};
  const Planes planes = find_planes(positions(map, kept), map.parameters);
  const double n = map.parameters.min_surface_points();
  for (const Indices& few : planes.small)
    for (const std::uint32_t i : few)
      reasons[kept[i]] = {Reason::too_few_points, static_cast<double>(few.size()), n + 1};
  for (const PlaneFit& plane : planes.found)
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
