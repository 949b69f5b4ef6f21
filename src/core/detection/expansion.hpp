#pragma once

#include "detection/detector.hpp"
#include "detection/sure_plane.hpp"
#include "geometry/disjoint_sets.hpp"

#include <map>
#include <tsl/robin_map.h>
#include <utility>
#include <vector>

namespace octosurf::detection {

/// Surfaces' planes with covariance, each computed once.
class SurePlanes {
 public:
  explicit SurePlanes(const surfaces::MapView& map) : map_(map), model_(map.noise, map.grid.resolution()) {}

  const sensing::ReadingModel& model() const { return model_; }
  Patch patch(SurfaceId id) const { return patch_of(*map_.surfaces.find(id), model_); }
  double log_ratio(SurfaceId id, PointId i) { return plane(id).log_ratio(map_.window[i]); }
  bool fits(SurfaceId id, PointId i) { return plane(id).fits(map_.window[i]); }

 private:
  const SurePlane& plane(SurfaceId id) {
    if (last_ == planes_.end() || last_->first != id) last_ = planes_.find(id);
    if (last_ == planes_.end()) last_ = planes_.emplace(id, SurePlane(patch(id), model_)).first;
    return last_->second;
  }

  const surfaces::MapView& map_;
  sensing::ReadingModel model_;
  std::map<SurfaceId, SurePlane> planes_;
  std::map<SurfaceId, SurePlane>::iterator last_ = planes_.end();  // points near each other mostly ask for it
};

/// The cell of each surface's plane that is nearest to a point: squared distance in cells, and packed cell.
using NearestCells = std::map<SurfaceId, std::pair<int, std::uint64_t>>;

/// What surfaces have gained in an expansion so far, and the rules of expand() by which they gain. It does
/// not search: expand() walks from rims, its slow twin in the tests looks at everything.
class Expansion {
 public:
  explicit Expansion(const surfaces::MapView& cells);

  int reach() const { return reach_; }          ///< voxels, of neighbours
  int gap() const { return gap_; }              ///< voxels, of h
  int plane_gap() const { return plane_gap_; }  ///< cells of planes, of h

  SurfaceId owner(PointId i) const {
    if (map_.window[i].surface != 0) return map_.window[i].surface;
    return has_gained_.contains(i) ? gained_.at(i) : 0;
  }
  void gain(const std::vector<Assignment>& some) {
    for (const auto& [i, id] : some)
      if (has_gained_.insert(i)) gained_.emplace(i, id);
  }
  bool fits(SurfaceId id, PointId i) { return planes_.fits(id, i); }
  /// Surfaces in the blocks within so many cells; valid until the next call.
  const std::vector<SurfaceId>& ids_near(PointId i, int cells);

  /// The surface that explains a pending point best, of those that own its neighbours; 0: none.
  SurfaceId surface_beside(PointId i);
  /// The same of those that end beyond a gap: `nearest` has one cell for each.
  SurfaceId surface_across(PointId i, const NearestCells& nearest);
  /// Connected pending points around `seed` that fit the surface, if there are enough to contradict it, and
  /// more than the points beside them that do not fit or have another surface: another plane passes there.
  std::vector<PointId> piece_of(PointId seed, SurfaceId id, occupancy::PointSet& looked_at);
  /// In key order, so that sums are rounded the same; without pieces that are not one plane with their
  /// surface.
  std::vector<Assignment> accepted() const;

 private:
  bool is_separated(PointId i, PointId j, SurfaceId id);
  bool is_open(const surfaces::SurfaceModel& surface, PointId i, const Eigen::Vector3d& boundary) const;
  geometry::DisjointSets connected(const std::vector<Assignment>& gained) const;
  bool merges(SurfaceId id, const std::vector<PointId>& points) const;

  const surfaces::MapView& map_;
  SurePlanes planes_;
  int reach_, gap_, plane_gap_;
  tsl::robin_map<PointId, SurfaceId> gained_;
  occupancy::PointSet has_gained_;
  tsl::robin_map<std::uint64_t, std::vector<SurfaceId>, geometry::PackedKeyHash> ids_near_;  // by blocks
  std::uint64_t last_blocks_ = 0;                                                            // none have this
  const std::vector<SurfaceId>* last_ids_ = nullptr;
};

}  // namespace octosurf::detection
