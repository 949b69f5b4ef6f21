#include "detection/expand.hpp"

#include "detection/constants.hpp"
#include "detection/expansion.hpp"
#include "detection/voxel_blocks.hpp"

#include <algorithm>
#include <map>
#include <tsl/robin_map.h>
#include <tuple>
#include <utility>

namespace octosurf::detection {
namespace {

/// Pending points: the fresh ones, or the others, or all.
enum class Pending { fresh, others, all };

/// Walks from the rims of surfaces through the octree.
class RimWalk {
 public:
  /// `left`: pending points that no rim was compared with; `joined`: cells that were compared with no pending
  /// point.
  RimWalk(const surfaces::MapView& cells, std::span<const PointId> left, std::span<const PointId> joined)
      : map_(cells), expansion_(cells), left_(left), rims_(rims_near(left)) {
    for (const PointId i : joined)
      if (is_at_rim(i)) new_rims_.push_back({i, map_.window[i].surface});
  }

  std::vector<Assignment> run() {
    std::vector<Assignment> cells = beside(rims_, Pending::fresh);
    append(beside(new_rims_, Pending::others), cells);
    complete(cells);
    std::vector<PointId> within = within_gap(rims_, Pending::fresh);
    append(within_gap(new_rims_, Pending::others), within);
    while (!cells.empty() || !within.empty()) {
      append(within_gap(cells, Pending::all), within);
      cells = across_gaps(std::move(within));
      complete(cells);
      within.clear();
    }
    return expansion_.accepted();
  }

 private:
  /// Cells at most h from these points, not all around which their surface has cells. Points of cells h
  /// apart along a plane are up to a voxel farther apart.
  std::vector<Assignment> rims_near(std::span<const PointId> left) const {
    std::vector<Assignment> rims;
    occupancy::PointSet looked_at;
    for (const auto& [place, box] : blocks_.boxes(map_.window, left, expansion_.gap() + 1))
      map_.window.for_each_in(occupancy::key_of(box.low), occupancy::key_of(box.high), [&](PointId i) {
        const SurfaceId id = map_.window[i].surface;
        if (id != 0 && looked_at.insert(i) && is_at_rim(i)) rims.push_back({i, id});
      });
    return rims;
  }
  bool is_at_rim(PointId i) const {
    const surfaces::SurfaceModel& surface = model(map_.window[i].surface);
    return !surface.surrounded(surface.cell_of(map_.window[i].position));
  }
  /// Neighbouring points mostly have the same.
  const surfaces::SurfaceModel& model(SurfaceId id) const {
    if (last_ == nullptr || last_->id() != id) last_ = map_.surfaces.find(id);
    return *last_;
  }

  /// One round: what surfaces gain of the pending points that have one of these cells as neighbour.
  std::vector<Assignment> beside(const std::vector<Assignment>& cells, Pending which) {
    std::vector<PointId> points;
    for (const Assignment& cell : cells) points.push_back(cell.point);
    const occupancy::PointSet from(points);
    occupancy::PointSet looked_at;
    std::vector<Assignment> gained;
    for_each_near(points, expansion_.reach(), which, [&](PointId i) {
      if (!looked_at.insert(i)) return;
      bool beside = false;
      map_.neighbours.for_each_within(i, expansion_.reach(), [&](PointId j) { beside |= from.contains(j); });
      if (!beside) return;
      if (const SurfaceId id = expansion_.surface_beside(i); id != 0) gained.push_back({i, id});
    });
    expansion_.gain(gained);
    return gained;
  }
  /// Adds what is beside these, round after round, until none is left.
  void complete(std::vector<Assignment>& cells) {
    for (std::vector<Assignment> gained = beside(cells, Pending::all); !gained.empty();
         gained = beside(gained, Pending::all))
      append(gained, cells);
  }
  template <class Item>
  static void append(const std::vector<Item>& some, std::vector<Item>& to) {
    to.insert(to.end(), some.begin(), some.end());
  }

  /// visit(PointId) for the pending points in boxes around the points in each block, `reach` voxels wider.
  template <class Visit>
  void for_each_near(std::span<const PointId> points, int reach, Pending which, Visit&& visit) {
    for (const auto& [place, box] : blocks_.boxes(map_.window, points, reach))
      map_.window.for_each_in(occupancy::key_of(box.low), occupancy::key_of(box.high), [&](PointId i) {
        if (expansion_.owner(i) == 0 &&
            (which == Pending::all || left_.contains(i) == (which == Pending::fresh)))
          visit(i);
      });
  }

  /// Pieces of what is pending around these points.
  std::vector<Assignment> across_gaps(std::vector<PointId> within) {
    map_.window.put_in_order(within);
    std::vector<Assignment> gained;
    occupancy::PointSet looked_at;
    for (const PointId seed : within) {
      if (expansion_.owner(seed) != 0 || looked_at.contains(seed)) continue;
      const SurfaceId id = expansion_.surface_across(seed, nearest_.at(seed));
      if (id == 0) continue;
      for (const PointId i : expansion_.piece_of(seed, id, looked_at)) gained.push_back({i, id});
    }
    expansion_.gain(gained);
    return gained;
  }

  /// The pending points that fit the surface of a cell which is at most h away along its plane.
  std::vector<PointId> within_gap(const std::vector<Assignment>& cells, Pending which) {
    std::vector<std::tuple<SurfaceId, VoxelBlocks::Place, PointId>> in_order;
    for (const auto& [cell, id] : cells) in_order.emplace_back(id, blocks_.of(map_.window[cell].key), cell);
    std::sort(in_order.begin(), in_order.end());
    std::vector<PointId> within, points;
    std::vector<RimCell> of_block;
    for (auto at = in_order.begin(); at != in_order.end();) {
      const auto [id, place, first] = *at;
      points.clear();
      of_block.clear();
      for (; at != in_order.end() && std::get<0>(*at) == id && std::get<1>(*at) == place; ++at) {
        points.push_back(std::get<2>(*at));
        of_block.push_back({id, model(id).cell_of(map_.window[points.back()].position)});
      }
      for_each_near(points, expansion_.gap() + 1, which, [&](PointId i) {
        if (expansion_.fits(of_block.front().surface, i) && comes_near(i, of_block)) within.push_back(i);
      });
    }
    return within;
  }

  /// Keeps the nearest of these cells of one surface, if it is nearer than the one before.
  bool comes_near(PointId i, const std::vector<RimCell>& cells) {
    const SurfaceId id = cells.front().surface;
    const geometry::PlaneCell from = model(id).cell_of(map_.window[i].position);
    const auto distance = [&](const RimCell& rim) {
      const int u = rim.cell.u - from.u, v = rim.cell.v - from.v;
      return std::pair(u * u + v * v, rim.cell.packed());
    };
    const RimCell nearest = *std::min_element(
        cells.begin(), cells.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    if (distance(nearest).first > expansion_.plane_gap() * expansion_.plane_gap()) return false;
    std::vector<RimCell>& known = nearest_[i];
    const auto at =
        std::find_if(known.begin(), known.end(), [&](const RimCell& r) { return r.surface == id; });
    if (at == known.end())
      known.push_back(nearest);
    else if (distance(nearest) < distance(*at))
      *at = nearest;
    return true;
  }

  const surfaces::MapView& map_;
  Expansion expansion_;
  mutable const surfaces::SurfaceModel* last_ = nullptr;
  VoxelBlocks blocks_{8};  // effort: voxels, as the octree's
  occupancy::PointSet left_;
  std::vector<Assignment> rims_, new_rims_;
  tsl::robin_map<PointId, std::vector<RimCell>> nearest_;  // one cell of each surface within h
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

std::vector<Assignment> expand(const surfaces::MapView& map, std::span<const PointId> fresh) {
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
  std::vector<PointId> pending, joined;
  for (const PointId cell : map.cells.of(fresh)) {
    const SurfaceId id = cells.window[cell].surface;
    (id == 0 ? pending : joined).push_back(cell);
    if (id != 0) map.cells.for_each_voxel(cell, [&](PointId voxel) { offer(voxel, cell, id); });
  }
  for (const auto& [cell, id] : RimWalk(cells, pending, joined).run()) {
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

std::vector<PointId> touching(const surfaces::MapView& map, std::span<const PointId> owned) {
  SurePlanes planes(map);
  const int gap = static_cast<int>(map.parameters.max_hole_size() / map.grid.resolution());
  std::map<std::pair<SurfaceId, SurfaceId>, bool> alike;
  std::vector<PointId> points;
  for (const PointId point : owned) {
    const occupancy::VoxelPoint& p = map.window[point];
    if (p.surface == 0) continue;
    const auto may_be_one = [&](SurfaceId other) {
      if (other == p.surface || !(planes.log_ratio(other, point) > 0)) return false;
      const auto [at, fresh] = alike.try_emplace(std::minmax(p.surface, other), false);
      if (fresh)
        at->second = log_same(planes.patch(p.surface), planes.patch(other), p.position.cast<double>()) > 0;
      return at->second;
    };
    const surfaces::SurfaceStore::Ids ids = map.surfaces.near(p.key, gap);
    if (std::any_of(ids.begin(), ids.end(), may_be_one)) points.push_back(point);
  }
  return points;
}

}  // namespace octosurf::detection
