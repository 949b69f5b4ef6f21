#include "detection/expand.hpp"

#include "detection/constants.hpp"
#include "detection/neighbour_labels.hpp"
#include "detection/patch_graph.hpp"
#include "detection/seed_patches.hpp"
#include "detection/sure_plane.hpp"
#include "detection/voxel_blocks.hpp"
#include "geometry/disjoint_sets.hpp"
#include "geometry/interruption.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tsl/robin_map.h>
#include <tsl/robin_set.h>
#include <utility>

namespace octosurf::detection {
namespace {

/// Surfaces' planes with covariance, each computed once.
class SurePlanes {
 public:
  explicit SurePlanes(const surfaces::MapView& map) : map_(map), model_(map.noise, map.grid.resolution()) {}

  const sensing::ReadingModel& model() const { return model_; }
  Patch patch(SurfaceId id) const { return patch_of(*map_.surfaces.find(id), model_); }
  double log_ratio(SurfaceId id, PointId i) {
    auto at = planes_.find(id);
    if (at == planes_.end()) at = planes_.emplace(id, SurePlane(patch(id), model_)).first;
    return at->second.log_ratio(map_.window[i]);
  }

 private:
  const surfaces::MapView& map_;
  sensing::ReadingModel model_;
  tsl::robin_map<SurfaceId, SurePlane> planes_;
};

/// Expansion of surfaces over pending cells.
class Flood {
 public:
  /// `voxel`: m.
  Flood(const surfaces::MapView& cells, double voxel, Guards guards)
      : map_(cells),
        guarded_(guards == Guards::on),
        planes_(cells),
        reach_(occupancy::Neighbours::voxels(cells.parameters.max_hole_size(), cells.grid.resolution())),
        gap_(static_cast<int>(cells.parameters.max_hole_size() / cells.grid.resolution() + 1e-9)),
        plane_gap_(static_cast<int>(cells.parameters.max_hole_size() / voxel + 1e-9)) {}

  void run(std::vector<PointId> left) {
    if (!guarded_) {
      while (claim_within_h(left)) {
      }
      return;
    }
    flood(left);
    while (!left.empty()) {
      map_.window.put_in_order(left);
      std::vector<Assignment> gained = across_gaps(left);
      const std::vector<Assignment> more = flood(pending_around(gained));
      gained.insert(gained.end(), more.begin(), more.end());
      left = pending_within_gap(gained);
    }
  }

  /// In key order, so that sums are rounded the same; without pieces that are not one plane with their
  /// surface.
  std::vector<Assignment> accepted() {
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
      if (guarded_ && !merges(all[root].surface, points)) refused.insert(root);
    std::vector<Assignment> kept;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (!refused.contains(sets.root(k))) kept.push_back(all[k]);
    return kept;
  }

 private:
  /// One round; false if no point was assigned.
  bool claim_within_h(const std::vector<PointId>& left) {
    std::vector<Assignment> round;
    for (const PointId i : left)
      if (owner(i) == 0)
        if (const SurfaceId id = surface_across_gap(i); id != 0) round.push_back({i, id});
    for (const auto& [i, id] : round) gain(i, id);
    return !round.empty();
  }

  void gain(PointId i, SurfaceId id) {
    gained_.emplace(i, id);
    const geometry::PlaneCell cell = map_.surfaces.find(id)->cell_of(map_.window[i].position);
    gained_cells_[id].insert(cell.packed());
    const VoxelBlocks::Place block = blocks_.of(map_.window[i].key);
    if (gained_blocks_[id].insert(block).second)
      for (const VoxelBlocks::Place near : blocks_.widened({block}, gap_ + 1)) gained_near_[near].insert(id);
  }

  /// Round after round, points beside inliers.
  std::vector<Assignment> flood(std::vector<PointId> frontier) {
    std::vector<Assignment> all;
    while (!frontier.empty()) {
      std::vector<Assignment> round;
      for (const PointId i : frontier)
        if (owner(i) == 0)
          if (const SurfaceId id = best_surface(i); id != 0) round.push_back({i, id});
      for (const auto& [i, id] : round) gain(i, id);
      all.insert(all.end(), round.begin(), round.end());
      frontier = pending_around(round);
    }
    return all;
  }

  /// Pieces of `left`, in key order, and of what is pending beside them.
  std::vector<Assignment> across_gaps(const std::vector<PointId>& left) {
    std::vector<Assignment> all;
    occupancy::PointSet looked_at;
    for (const PointId seed : left) {
      if (owner(seed) != 0 || looked_at.contains(seed)) continue;
      const SurfaceId id = surface_across_gap(seed);
      if (id == 0) continue;
      for (const PointId i : piece_of(seed, id, looked_at)) all.push_back({i, id});
    }
    for (const auto& [i, id] : all) gain(i, id);
    return all;
  }

  /// The surface that explains a pending point best, of those that end at most h away along their plane.
  SurfaceId surface_across_gap(PointId i) {
    geometry::end_if_interrupted();
    // Points of cells h apart are up to a voxel farther apart.
    const surfaces::SurfaceStore::Ids known = ids_within(plane_gap_ + 1, i);
    std::set<SurfaceId> ids(known.begin(), known.end());
    if (const auto gained = gained_near_.find(blocks_.of(map_.window[i].key)); gained != gained_near_.end())
      ids.insert(gained->second.begin(), gained->second.end());
    SurfaceId best = 0;
    double most = 0;
    for (const SurfaceId id : ids) {
      const double log_ratio = planes_.log_ratio(id, i);
      if (!(log_ratio > most) || !reaches(id, i)) continue;
      most = log_ratio;
      best = id;
    }
    return best;
  }

  /// Whether the nearest cell of the plane's hash is beyond a gap, at most h away, and nothing hides it.
  /// Beside a cell, flood() has decided.
  bool reaches(SurfaceId id, PointId i) const {
    const surfaces::SurfaceModel& surface = *map_.surfaces.find(id);
    const geometry::PlaneCell from = surface.cell_of(map_.window[i].position);
    const auto gained = gained_cells_.find(id);
    const auto within_gap = [&](geometry::PlaneCell cell) {
      const int u = cell.u - from.u, v = cell.v - from.v;
      return u * u + v * v <= plane_gap_ * plane_gap_ &&
             (surface.occupied(cell) ||
              (gained != gained_cells_.end() && gained->second.contains(cell.packed())));
    };
    const auto cell = geometry::first_in_rings(from, guarded_ ? 1 : 0, plane_gap_, within_gap);
    if (!guarded_) return cell.has_value();
    const int beside = (2 << map_.level) - 1;  // points of adjacent cells are at most so far apart
    return cell && std::max(std::abs(cell->u - from.u), std::abs(cell->v - from.v)) > beside &&
           is_open(surface, i, surface.centre_of(*cell).cast<float>());
  }

  /// No reading off the plane lies between the two or just above: it would be of an object on the plane, such
  /// as a board, or of a wall.
  bool is_open(const surfaces::SurfaceModel& surface, PointId i, const Eigen::Vector3f& boundary) const {
    const Eigen::Vector3d& normal = surface.plane().normal;
    const auto on_plane = [&](const Eigen::Vector3f& p) {
      return Eigen::Vector3f(p - (surface.distance(p) * normal).cast<float>());
    };
    const Eigen::Vector3f from = on_plane(map_.window[i].position), line = on_plane(boundary) - from;
    const double above = planes_.model().reach(map_.window[i].range_class, 1) + map_.grid.resolution();
    const int steps = static_cast<int>(2 * line.norm() / map_.grid.resolution());
    for (int k = 1; k < steps; ++k)
      for (const double height : {0.0, above}) {
        geometry::VoxelKey key;
        const Eigen::Vector3f at = from + line * (static_cast<float>(k) / static_cast<float>(steps)) +
                                   (height * normal).cast<float>();
        if (!map_.grid.key_of(at, key)) return false;
        const PointId there = map_.window.find(key);
        if (there != PointId::none && owner(there) != surface.id() &&
            !planes_.model().belongs(map_.window[there], surface.plane()))
          return false;
      }
    return true;
  }

  /// Connected pending points around `seed` that fit the surface, if there are enough to contradict it, and
  /// most of the points that they touch fit, too: else they are where another plane passes.
  std::vector<PointId> piece_of(PointId seed, SurfaceId id, occupancy::PointSet& looked_at) {
    std::vector<PointId> piece{seed};
    occupancy::PointSet others;
    std::size_t unfit = 0;
    looked_at.insert(seed);
    for (std::size_t k = 0; k < piece.size(); ++k)
      map_.neighbours.for_each_within(piece[k], reach_, [&](PointId j) {
        if (owner(j) == id || looked_at.contains(j)) return;
        if (owner(j) == 0 && planes_.log_ratio(id, j) > 0) {
          looked_at.insert(j);
          piece.push_back(j);
        } else if (others.insert(j)) {
          ++unfit;
        }
      });
    if (piece.size() < Constants::fewest_of_plane || piece.size() <= unfit) piece.clear();
    return piece;
  }

  /// Where pieces may follow across the next gap. Effort: around one gained point in each cube of a quarter
  /// of h.
  std::vector<PointId> pending_within_gap(const std::vector<Assignment>& gained) const {
    const VoxelBlocks cubes(std::max(1, gap_ / 4));
    std::set<VoxelBlocks::Place> taken;
    std::vector<PointId> within;
    for (const Assignment& assignment : gained) {
      const geometry::VoxelKey key = map_.window[assignment.point].key;
      if (!taken.insert(cubes.of(key)).second) continue;
      map_.window.for_each_near(key, gap_, [&](PointId i) {
        if (owner(i) == 0) within.push_back(i);
      });
    }
    return within;
  }

  SurfaceId owner(PointId i) const {
    const auto gained = gained_.find(i);
    return gained == gained_.end() ? map_.window[i].surface : gained->second;
  }

  SurfaceId best_surface(PointId i) {
    geometry::end_if_interrupted();
    NeighbourLabels near;
    map_.neighbours.for_each_within(i, reach_, [&](PointId j) {
      const SurfaceId id = owner(j);
      near.add(id != 0 && is_separated(i, j, id) ? clutter : id);
    });
    return near.best([&](SurfaceId id) { return planes_.log_ratio(id, i); });
  }

  /// A surface at an angle to that of `j` explains `j`, too, or passes between the two and has inliers there.
  bool is_separated(PointId i, PointId j, SurfaceId id) {
    const std::vector<SurfaceId>& ids = ids_near(j);
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

  /// `reach`: voxels.
  surfaces::SurfaceStore::Ids ids_within(int reach, PointId i) const {
    return map_.surfaces.near(map_.first_voxel_of(map_.window[i].key), reach);
  }
  const std::vector<SurfaceId>& ids_near(PointId i) {
    const auto [at, fresh] = ids_near_.try_emplace(i);
    if (fresh) {
      const surfaces::SurfaceStore::Ids ids = ids_within(1 << map_.level, i);
      at.value().assign(ids.begin(), ids.end());
    }
    return at->second;
  }

  std::vector<PointId> pending_around(const std::vector<Assignment>& round) const {
    std::vector<PointId> around;
    for (const Assignment& assignment : round)
      map_.neighbours.for_each_within(assignment.point, reach_, [&](PointId j) {
        if (owner(j) == 0) around.push_back(j);
      });
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }

  /// Neighbours assigned to the same surface.
  geometry::DisjointSets connected(const std::vector<Assignment>& gained) const {
    geometry::DisjointSets sets(gained.size());
    tsl::robin_map<PointId, std::size_t> place;
    for (std::size_t k = 0; k < gained.size(); ++k) place.emplace(gained[k].point, k);
    for (std::size_t k = 0; k < gained.size(); ++k)
      map_.neighbours.for_each_within(gained[k].point, reach_, [&](PointId j) {
        if (const auto at = place.find(j);
            at != place.end() && gained[at->second].surface == gained[k].surface)
          sets.join(k, at->second);
      });
    return sets;
  }

  bool merges(SurfaceId id, const std::vector<PointId>& points) const {
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

  const surfaces::MapView& map_;
  bool guarded_;
  SurePlanes planes_;
  int reach_;      // of neighbours
  int gap_;        // of h
  int plane_gap_;  // of h, cells of the planes
  tsl::robin_map<PointId, SurfaceId> gained_;
  tsl::robin_map<SurfaceId, tsl::robin_set<std::uint64_t, geometry::PackedKeyHash>> gained_cells_;
  using Places = tsl::robin_set<VoxelBlocks::Place, geometry::PackedKeyHash>;
  VoxelBlocks blocks_{8};  // effort: voxels, as the octree's
  tsl::robin_map<SurfaceId, Places> gained_blocks_;
  tsl::robin_map<VoxelBlocks::Place, std::set<SurfaceId>, geometry::PackedKeyHash>
      gained_near_;  // surfaces that gained points within h of a block
  tsl::robin_map<PointId, std::vector<SurfaceId>> ids_near_;
};

}  // namespace

std::vector<Assignment> add_inliers(const surfaces::MapView& map, std::span<const PointId> fresh) {
  SurePlanes planes(map);
  std::vector<Assignment> added;
  for (const PointId i : fresh) {
    Assignment best{i, 0};
    double most = 0;
    for (const SurfaceId id : map.surfaces.near(map.window[i].key, 1)) {
      const surfaces::SurfaceModel& surface = *map.surfaces.find(id);
      if (!surface.covers(surface.cell_of(map.window[i].position))) continue;
      const double log_ratio = planes.log_ratio(id, i);
      if (!(log_ratio > most)) continue;
      most = log_ratio;
      best.surface = id;
    }
    if (best.surface != 0) added.push_back(best);
  }
  return added;
}

std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> left, Guards guards) {
  const surfaces::MapView& cells = map.cells.map();
  SurePlanes planes(map);
  std::vector<Assignment> gained;
  // The cell and its neighbours of the surface speak for it, those of another one or none against it.
  const auto offer = [&](PointId voxel, PointId cell, SurfaceId id) {
    if (!map.is_pending(voxel)) return;
    int agreeing = 1;
    for (const PointId j : cells.neighbours.of(cell)) agreeing += cells.window[j].surface == id ? 1 : -1;
    if (planes.log_ratio(id, voxel) + Constants::boundary_cost * agreeing > 0) gained.push_back({voxel, id});
  };
  std::vector<PointId> pending;
  for (const PointId cell : map.cells.of(left)) {
    if (const SurfaceId id = cells.window[cell].surface; id == 0)
      pending.push_back(cell);
    else
      map.cells.for_each_voxel(cell, [&](PointId voxel) { offer(voxel, cell, id); });
  }
  Flood flood(cells, map.grid.resolution(), guards);
  flood.run(std::move(pending));
  for (const auto& [cell, id] : flood.accepted()) {
    bool first = true;
    map.cells.for_each_voxel(cell, [&, at = cell, its = id](PointId voxel) {
      std::exchange(first, false) ? gained.push_back({voxel, its}) : offer(voxel, at, its);
    });
  }
  if (cells.level > 0)
    std::sort(gained.begin(), gained.end(), [&](const Assignment& a, const Assignment& b) {
      return map.window[a.point].key < map.window[b.point].key;
    });
  return gained;
}

std::vector<PointId> touching(const surfaces::MapView& map, std::span<const Assignment> assignments) {
  SurePlanes planes(map);
  const int gap = static_cast<int>(map.parameters.max_hole_size() / map.grid.resolution());
  std::map<std::pair<SurfaceId, SurfaceId>, bool> alike;
  std::vector<PointId> points;
  for (const auto& [point, surface] : assignments) {
    const occupancy::VoxelPoint& p = map.window[point];
    const auto may_be_one = [&, own = surface](SurfaceId other) {
      if (other == own || !(planes.log_ratio(other, point) > 0)) return false;
      const auto [at, fresh] = alike.try_emplace(std::minmax(own, other), false);
      if (fresh) at->second = log_same(planes.patch(own), planes.patch(other), p.position.cast<double>()) > 0;
      return at->second;
    };
    const surfaces::SurfaceStore::Ids ids = map.surfaces.near(p.key, gap);
    if (std::any_of(ids.begin(), ids.end(), may_be_one)) points.push_back(point);
  }
  return points;
}

}  // namespace octosurf::detection
