#pragma once

#include "surfaces/map_view.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace octosurf::surfaces {

/// A map's points by cells of 2^level voxels along each edge, each cell with the point of one of its voxels:
/// as in an octree of that resolution. Planes are found on cells, since voxels finer than the narrowest
/// surface needs only add readings. A cell has the surface of most of its voxels; on a tie the pending ones
/// count. With level 0 cells are the voxels. Blocks are read on first access. Valid until the octree's next
/// insert. Not thread-safe.
class Cells {
 public:
  /// The largest level whose cells are no wider than two thirds of the narrowest surface, so that a strip of
  /// it covers one and a half of them, and than a quarter of h.
  explicit Cells(const MapView& voxels);
  Cells(const Cells&) = delete;
  Cells& operator=(const Cells&) = delete;

  /// Of the cells: grid, window and parameters in their units. Its `cells` are these.
  const MapView& map() const { return coarse_ ? coarse_->map : voxels_; }
  /// visit(PointId voxel) for those of a cell; first the one whose point is the cell's.
  template <class Visit>
  void for_each_voxel(PointId cell, Visit&& visit) const {
    if (!coarse_) return visit(cell);
    for (auto k = coarse_->first[index_of(cell)]; k < coarse_->first[index_of(cell) + 1]; ++k)
      visit(coarse_->members[k]);
  }
  /// The cell of a voxel with a point.
  PointId of(PointId voxel) const { return coarse_ ? coarse_->map.find(voxels_.window[voxel].key) : voxel; }
  /// Those of some voxels, each once, in key order.
  std::vector<PointId> of(std::span<const PointId> voxels) const;
  /// The pending voxels of some cells, in key order.
  std::vector<PointId> pending_in(std::span<const PointId> cells) const;
  std::size_t pending_in(PointId cell) const;

  /// Call it after a voxel's surface has changed.
  void reassigned(PointId voxel);

 private:
  struct Coarse {
    Coarse(const MapView& voxels, const Cells& cells, int level);
    void read_block(geometry::VoxelKey corner, std::vector<occupancy::VoxelPoint>& points);
    /// Moves the voxel whose point is the cell's to the front: the one nearest to the mean of those of the
    /// cell's surface, since a mean of two faces would lie on neither.
    occupancy::VoxelPoint represent(std::span<PointId> its, geometry::VoxelKey cell) const;
    SurfaceId most_common_surface(std::span<const PointId> its) const;

    const MapView& voxels;
    Parameters parameters;
    geometry::VoxelGrid grid;
    occupancy::PointWindow window;
    occupancy::Neighbours neighbours;
    MapView map;
    std::vector<PointId> members;                        // voxels, cell by cell
    std::vector<std::uint32_t> first{0};                 // in `members`, of each cell
    std::vector<PointId> cell_of;                        // of each voxel; none if not read
    std::vector<std::pair<unsigned, PointId>> in_block;  // scratch
  };
  const MapView& voxels_;
  std::optional<Coarse> coarse_;  // of level 1 and more
};

class LoadedView;

/// Views of one map, one for each thread, each of which loads its blocks once however often it is used, and
/// repeats what has been assigned meanwhile.
class ThreadViews {
 public:
  explicit ThreadViews(const MapView& own) : own_(own) {}
  ~ThreadViews();

  /// Call it before threads use their views.
  void prepare(int threads) const;
  /// Thread 0 has the map itself. Each thread may ask for its own, while nothing is assigned.
  const MapView& of(int thread) const;
  /// Call it after a voxel's surface has changed.
  void reassigned(PointId voxel) {
    if (!others_.empty()) assigned_.emplace_back(own_.window[voxel].key, own_.window[voxel].surface);
  }

 private:
  struct Other {
    std::unique_ptr<LoadedView> view;
    std::size_t applied = 0;  // of `assigned_`
  };
  const MapView& own_;
  mutable std::vector<Other> others_;
  std::vector<std::pair<geometry::VoxelKey, SurfaceId>> assigned_;
};

/// A view with what it loads.
class LoadedView : public MapView {
 public:
  /// To read a map that does not change.
  explicit LoadedView(const MapState& state) : LoadedView(state, occupancy::PointWindow(state.occupancy)) {}
  /// For another thread.
  explicit LoadedView(const MapView& map)
      : MapView{map.parameters,   map.octree, map.grid, map.surfaces,
                map.cylinders,    map.noise,  points_,  neighbours_of_points_,
                cells_of_points_, views_},
        points_(map.octree),
        neighbours_of_points_(points_, grid.resolution()),
        cells_of_points_(*this) {}
  LoadedView(const LoadedView&) = delete;  // the view refers to its members
  LoadedView& operator=(const LoadedView&) = delete;

 protected:
  friend ThreadViews;
  void assign(PointId i, SurfaceId surface) {
    points_.assign(i, surface);
    cells_of_points_.reassigned(i);
    views_.reassigned(i);
  }

  LoadedView(const MapState& state, occupancy::PointWindow points)
      : MapView{state.parameters, state.occupancy, state.occupancy.grid(), state.surfaces,   state.cylinders,
                state.noise,      points_,         neighbours_of_points_,  cells_of_points_, views_},
        points_(std::move(points)),
        neighbours_of_points_(points_, grid.resolution()),
        cells_of_points_(*this) {}

  occupancy::PointWindow points_;
  occupancy::Neighbours neighbours_of_points_;
  Cells cells_of_points_;
  ThreadViews views_{*this};
};

}  // namespace octosurf::surfaces
