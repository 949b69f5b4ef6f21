#include "detection/expand.hpp"

#include "detection/constants.hpp"
#include "detection/expansion.hpp"
#include "detection/voxel_blocks.hpp"
#include "detection/voxel_marks.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <tsl/robin_map.h>
#include <utility>

namespace octosurf::detection {
namespace {

/// Pending points: all, or those that are not fresh.
enum class Pending { all, others };

/// Walks over the rims of surfaces through the octree.
class RimWalk {
 public:
  /// `left`: pending points that were compared with no rim; `joined`: cells that were compared with no
  /// pending point.
  RimWalk(const surfaces::MapView& cells, std::span<const PointId> left, std::span<const PointId> joined)
      : map_(cells), expansion_(cells), left_(left), fresh_(left) {
    for (const PointId i : joined)
      if (is_at_rim(i)) new_rims_.push_back({i, map_.window[i].surface});
  }

  std::vector<Assignment> run() {
    std::vector<Assignment> cells = beside_rims();
    append(beside(new_rims_, Pending::others), cells);
    complete(cells);
    std::vector<PointId> within = within_gap_of_rims();
    append(within_gap(new_rims_, Pending::others), within);
    while (!cells.empty() || !within.empty()) {
      append(within_gap(cells, Pending::all), within);
      cells = across_gaps(std::exchange(within, {}));
      complete(cells);
    }
    return expansion_.accepted();
  }

 private:
  /// Not all around it its surface has cells.
  bool is_at_rim(PointId i) const {
    const surfaces::SurfaceModel& surface = model(map_.window[i].surface);
    return !surface.surrounded(surface.cell_of(map_.window[i].position));
  }
  /// Neighbouring points mostly have the same.
  const surfaces::SurfaceModel& model(SurfaceId id) const {
    if (last_ == nullptr || last_->id() != id) last_ = map_.surfaces.find(id);
    return *last_;
  }

  /// What surfaces gain of the fresh points that have a rim's cell as neighbour.
  std::vector<Assignment> beside_rims() {
    occupancy::PointSet tested, rims;
    const auto is_rim = [&](PointId i) {
      if (map_.window[i].surface == 0) return false;
      if (tested.insert(i) && is_at_rim(i)) rims.insert(i);
      return rims.contains(i);
    };
    std::vector<Assignment> gained;
    for (const PointId i : left_) gain_if_beside(i, is_rim, gained);
    expansion_.gain(gained);
    return gained;
  }
  /// One round: what surfaces gain of the pending points that have one of these cells as neighbour. Those
  /// beyond the 26 voxels around have it only if they have few beside them.
  std::vector<Assignment> beside(const std::vector<Assignment>& cells, Pending which) {
    VoxelMarks adjacent, farther;
    occupancy::PointSet from;
    std::vector<PointId> points;
    for (const Assignment& cell : cells) {
      from.insert(cell.point);
      points.push_back(cell.point);
      adjacent.add(map_.window[cell.point].key, 1);
    }
    if (expansion_.reach() > 1)
      for (const auto& [place, box] : boxes_.boxes(map_.window, points, expansion_.reach())) farther.add(box);
    std::vector<Assignment> gained;
    const auto is_from = [&](PointId i) { return from.contains(i); };
    adjacent.for_each_point(map_.window, [&](PointId i) {
      if (may_gain(i, which)) gain_if_beside(i, is_from, gained);
    });
    farther.for_each_point(map_.window, adjacent, [&](PointId i) {
      if (may_gain(i, which) && !map_.neighbours.are_adjacent(i)) gain_if_beside(i, is_from, gained);
    });
    expansion_.gain(gained);
    return gained;
  }
  template <class IsCell>
  void gain_if_beside(PointId i, IsCell&& is_cell, std::vector<Assignment>& gained) {
    bool beside = false;
    map_.neighbours.for_each_within(i, expansion_.reach(), [&](PointId j) { beside = beside || is_cell(j); });
    if (!beside) return;
    if (const SurfaceId id = expansion_.surface_beside(i); id != 0) gained.push_back({i, id});
  }
  bool may_gain(PointId i, Pending which) const {
    return expansion_.owner(i) == 0 && !(which == Pending::others && fresh_.contains(i));
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

  /// The fresh points that fit a surface of which a rim's cell is at most h away along its plane.
  std::vector<PointId> within_gap_of_rims() {
    std::vector<PointId> within;
    for (const PointId i : left_) {
      if (expansion_.owner(i) != 0) continue;
      for (const SurfaceId id : expansion_.ids_near(i, expansion_.gap() + 1))
        if (expansion_.fits(id, i) && comes_near(i, id, model(id).raster(), Cells::at_rim))
          within.push_back(i);
    }
    return within;
  }
  /// The pending points that fit the surface of a cell which is at most h away along its plane.
  std::vector<PointId> within_gap(const std::vector<Assignment>& cells, Pending which) {
    std::map<SurfaceId, std::vector<PointId>> of_surface;
    for (const auto& [cell, id] : cells) of_surface[id].push_back(cell);
    std::vector<PointId> within;
    for (const auto& [its, points] : of_surface) {
      const SurfaceId id = its;
      VoxelMarks marks;
      geometry::CellBits raster;
      for (const PointId cell : points) {
        marks.add(map_.window[cell].key, expansion_.gap() + 1);
        raster.change(model(id).cell_of(map_.window[cell].position), true);
      }
      marks.for_each_point(map_.window, [&](PointId i) {
        if (may_gain(i, which) && expansion_.fits(id, i) && comes_near(i, id, raster, Cells::all))
          within.push_back(i);
      });
    }
    return within;
  }

  enum class Cells { all, at_rim };
  /// Keeps the nearest of a surface's cells in a raster, if it is at most h away and nearer than the one
  /// before. False if none is that near.
  bool comes_near(PointId i, SurfaceId id, const geometry::CellBits& raster, Cells which) {
    constexpr int columns = 64, within_columns = columns - 2;  // without those beside the others
    const geometry::PlaneCell from = model(id).cell_of(map_.window[i].position);
    const int gap = expansion_.plane_gap();
    std::pair<int, std::uint64_t> nearest(gap * gap + 1, 0);  // squared distance, and cell
    rows_.resize(static_cast<std::size_t>(2 * gap + 3));
    for (int u = -gap; u <= gap; u += within_columns) {
      const int width = std::min(within_columns, gap - u + 1);
      raster.rows_from({from.u + u - 1, from.v - gap - 1}, width + 2, rows_);
      for (int v = -gap; v <= gap; ++v) {
        const std::uint64_t* row = &rows_[static_cast<std::size_t>(v + gap + 1)];
        std::uint64_t cells = row[0] & ((std::uint64_t{1} << width) - 1) << 1;
        const auto three = [](std::uint64_t r) { return r << 1 & r & r >> 1; };
        if (which == Cells::at_rim) cells &= ~(three(row[-1]) & row[0] << 1 & row[0] >> 1 & three(row[1]));
        for (; cells != 0; cells &= cells - 1) {
          const int along = u - 1 + std::countr_zero(cells);
          nearest = std::min(nearest, std::pair(along * along + v * v,
                                                geometry::PlaneCell{from.u + along, from.v + v}.packed()));
        }
      }
    }
    if (nearest.first > gap * gap) return false;
    std::pair<int, std::uint64_t>& known = nearest_[i].try_emplace(id, nearest).first->second;
    known = std::min(known, nearest);
    return true;
  }

  const surfaces::MapView& map_;
  Expansion expansion_;
  mutable const surfaces::SurfaceModel* last_ = nullptr;
  VoxelBlocks boxes_{
      4};  // effort: voxels; fewer are near none of a block's points, but there are more blocks
  std::span<const PointId> left_;
  occupancy::PointSet fresh_;
  std::vector<Assignment> new_rims_;
  tsl::robin_map<PointId, NearestCells> nearest_;  // of those within h
  std::vector<std::uint64_t> rows_;                // scratch
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
