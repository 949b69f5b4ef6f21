#include "detection/expansion.hpp"

#include "detection/clear_way.hpp"
#include "detection/constants.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/patch_graph.hpp"
#include "geometry/interruption.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace octosurf::detection {

Expansion::Expansion(const surfaces::MapView& cells)
    : map_(cells),
      planes_(cells),
      reach_(occupancy::Neighbours::voxels(cells.parameters.max_hole_size(), cells.grid.resolution())),
      gap_(static_cast<int>(cells.parameters.max_hole_size() / cells.grid.resolution() + 1e-9)),
      plane_gap_(static_cast<int>(
          cells.parameters.max_hole_size() * (1 << cells.level) / cells.grid.resolution() + 1e-9)) {}

SurfaceId Expansion::surface_beside(PointId i) {
  geometry::end_if_interrupted();
  NeighbourLabels<SurfaceId> near;
  map_.neighbours.for_each_within(i, reach_, [&](PointId j) {
    const SurfaceId id = owner(j);
    near.add(id != 0 && is_separated(i, j, id) ? clutter : id);
  });
  return near.best([&](SurfaceId id) { return planes_.log_ratio(id, i); });
}

SurfaceId Expansion::surface_across(PointId i, const NearestCells& nearest) {
  geometry::end_if_interrupted();
  const int beside = (2 << map_.level) - 1;  // points of adjacent cells are at most so far apart
  SurfaceId best = 0;
  double most = 0;
  for (const auto& [id, place] : nearest) {
    const geometry::PlaneCell cell = geometry::PlaneCell::unpack(place.second);
    const surfaces::SurfaceModel& surface = *map_.surfaces.find(id);
    const geometry::PlaneCell from = surface.cell_of(map_.window[i].position);
    const double log_ratio = planes_.log_ratio(id, i);
    if (!(log_ratio > most) || std::max(std::abs(cell.u - from.u), std::abs(cell.v - from.v)) <= beside ||
        !is_open(surface, i, surface.centre_of(cell)))
      continue;
    most = log_ratio;
    best = id;
  }
  return best;
}

/// A surface at an angle to that of `j` explains `j`, too, or passes between the two and has inliers there.
bool Expansion::is_separated(PointId i, PointId j, SurfaceId id) {
  const std::vector<SurfaceId>& ids = ids_near(j, 1);
  if (ids.size() < 2) return false;
  const Plane& plane = map_.surfaces.find(id)->plane();
  const Eigen::Vector3f a = map_.window[i].position, b = map_.window[j].position;
  return std::any_of(ids.begin(), ids.end(), [&](SurfaceId other) {
    const surfaces::SurfaceModel& wall = *map_.surfaces.find(other);
    if (std::fabs(plane.normal.dot(wall.plane().normal)) >= Constants::cos_nearly_parallel) return false;
    const double from = wall.distance(a), to = wall.distance(b);
    const Eigen::Vector3f at =
        from * to < 0 ? Eigen::Vector3f(a + static_cast<float>(from / (from - to)) * (b - a)) : b;
    return wall.nearest(wall.cell_of(at), 1).has_value() &&
           (from * to < 0 || planes_.log_ratio(other, j) > 0);
  });
}

bool Expansion::is_open(const surfaces::SurfaceModel& surface, PointId i,
                        const Eigen::Vector3d& boundary) const {
  const Eigen::Vector3d& normal = surface.plane().normal;
  const auto on_plane = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return p - surface.plane().signed_distance(p) * normal;
  };
  const double above = planes_.model().reach(map_.window[i].range_class, 1) + map_.grid.resolution();
  return is_clear_way(map_.grid, on_plane(map_.window[i].position.cast<double>()), on_plane(boundary),
                      above * normal, [&](geometry::VoxelKey key) {
                        const PointId there = map_.window.find(key);
                        return there != PointId::none && owner(there) != surface.id() &&
                               !planes_.model().belongs(map_.window[there], surface.plane());
                      });
}

std::vector<PointId> Expansion::piece_of(PointId seed, SurfaceId id, occupancy::PointSet& looked_at) {
  std::vector<PointId> piece{seed};
  occupancy::PointSet others;
  std::size_t unfit = 0;
  looked_at.insert(seed);
  for (std::size_t k = 0; k < piece.size(); ++k)
    map_.neighbours.for_each_within(piece[k], reach_, [&](PointId j) {
      if (owner(j) == id || looked_at.contains(j)) return;
      if (owner(j) == 0 && fits(id, j)) {
        looked_at.insert(j);
        piece.push_back(j);
      } else if (others.insert(j)) {
        ++unfit;
      }
    });
  if (piece.size() < Constants::fewest_of_plane || piece.size() <= unfit) piece.clear();
  return piece;
}

std::vector<Assignment> Expansion::accepted() const {
  std::vector<Assignment> all;
  for (const auto& [i, id] : gained_) all.push_back({i, id});
  const auto key = [this](const Assignment& a) { return map_.window[a.point].key; };
  std::sort(all.begin(), all.end(),
            [&](const Assignment& a, const Assignment& b) { return key(a) < key(b); });
  std::map<std::size_t, std::vector<PointId>> pieces;  // by root
  geometry::DisjointSets sets = connected(all);
  for (std::size_t k = 0; k < all.size(); ++k) pieces[sets.root(k)].push_back(all[k].point);
  std::set<std::size_t> refused;
  for (const auto& [root, points] : pieces)
    if (!merges(all[root].surface, points)) refused.insert(root);
  std::vector<Assignment> kept;
  for (std::size_t k = 0; k < all.size(); ++k)
    if (!refused.contains(sets.root(k))) kept.push_back(all[k]);
  return kept;
}

/// The same for all points around which the same blocks are.
const std::vector<SurfaceId>& Expansion::ids_near(PointId i, int cells) {
  const geometry::VoxelKey key = map_.first_voxel_of(map_.window[i].key);
  const int reach = cells << map_.level;
  std::uint64_t blocks = 1;
  for (const int k : {key.x, key.y, key.z}) {
    const int first = geometry::VoxelGrid::clamped(k - reach) >> surfaces::SurfaceStore::block_bits,
              last = geometry::VoxelGrid::clamped(k + reach) >> surfaces::SurfaceStore::block_bits;
    blocks = blocks << 20 | static_cast<std::uint64_t>(first << 7 | (last - first));
  }
  if (blocks == last_blocks_) return *last_ids_;
  const auto [at, fresh] = ids_near_.try_emplace(blocks);
  if (fresh) {
    const surfaces::SurfaceStore::Ids ids = map_.surfaces.near(key, reach);
    at.value().assign(ids.begin(), ids.end());
  }
  last_blocks_ = blocks;
  last_ids_ = &at->second;
  return *last_ids_;
}

/// Neighbours assigned to the same surface.
geometry::DisjointSets Expansion::connected(const std::vector<Assignment>& gained) const {
  geometry::DisjointSets sets(gained.size());
  tsl::robin_map<PointId, std::size_t> place;
  for (std::size_t k = 0; k < gained.size(); ++k) place.emplace(gained[k].point, k);
  for (std::size_t k = 0; k < gained.size(); ++k)
    map_.neighbours.for_each_within(gained[k].point, reach_, [&](PointId j) {
      if (const auto at = place.find(j); at != place.end() && gained[at->second].surface == gained[k].surface)
        sets.join(k, at->second);
    });
  return sets;
}

bool Expansion::merges(SurfaceId id, const std::vector<PointId>& points) const {
  if (points.size() < Constants::fewest_of_plane) return true;  // too few to contradict it
  const Patch surface = planes_.patch(id);
  Patch gain;
  gain.origin = map_.window[points.front()].position.cast<double>();
  gain.plane = surface.plane;
  gain.pose_variance = surface.pose_variance;
  gain.readings = gain.hits = static_cast<double>(points.size());
  double pairs = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PointId i : points) {
    const occupancy::VoxelPoint& p = map_.window[i];
    const double cos_incidence = surface.plane.normal.dot(p.view.cast<double>());
    gain.moments.add(p.position.cast<double>() - gain.origin,
                     planes_.model().weight(p.range_class, cos_incidence));
    gain.log_peaks += planes_.model().log_peak(p.range_class, cos_incidence);
    map_.window.for_each_near(p.key, 1, [&](PointId j) {
      if (map_.window[j].surface != id) return;
      ++pairs;
      sum += p.position.cast<double>();
    });
  }
  gain.fit();
  const Eigen::Vector3d at = pairs > 0 ? Eigen::Vector3d(sum / pairs) : gain.centroid();
  return log_same(surface, gain, at) > 0;
}

}  // namespace octosurf::detection
