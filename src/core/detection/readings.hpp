#pragma once

#include "detection/patch.hpp"
#include "sensing/reading_model.hpp"
#include "surfaces/cells.hpp"

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::detection {

/// The plane of a reading: index into a list of patches. 0 is clutter, which has no patch.
using Label = std::uint32_t;
inline constexpr Label clutter = 0;

/// Points that are segmented together.
struct Neighbourhood {
  std::vector<PointId> points;    ///< are labelled, and seed planes
  std::vector<PointId> may_join;  ///< were in no plane before: are labelled, but seed no plane
  std::vector<PointId> context;   ///< keep their labels; others may merge with them
};

/// The octree's summary of the readings in one voxel, or in one cell of voxels (surfaces::Cells).
struct Reading {
  geometry::VoxelKey key;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f view = Eigen::Vector3f::UnitZ();  ///< unit, toward the sensor
  std::uint8_t range_class = 0;
  bool may_seed = true;   ///< planes may begin with it
  float hits = 1;         ///< scans that hit the voxel, from its log-odds (at most about four)
  SurfaceId surface = 0;  ///< its current surface
  PointId point{};

  double cos_incidence(const Plane& plane) const { return plane.normal.dot(view.cast<double>()); }
  double distance(const Plane& plane) const { return plane.signed_distance(position.cast<double>()); }
};

/// Points of a map's cells, owned and pending alike, with their neighbours: all of them, or a
/// neighbourhood's. Points to be labelled come first, then their context. Each part is ordered by blocks of
/// 8³ voxels, then by keys, independent of the window's loading order.
class Readings {
 public:
  using Index = std::uint32_t;
  static constexpr Index none = ~Index{0};

  /// O(points), plus a word for each point that the window has loaded.
  Readings(const surfaces::MapView& map, const Neighbourhood& around);

  /// Number of readings to be labelled; higher indices are context.
  std::size_t size() const { return size_; }
  std::size_t size_with_context() const { return readings_.size(); }
  /// True for `none`, too.
  bool is_context(Index i) const { return i >= size_; }
  const Reading& operator[](Index i) const { return readings_[i]; }
  /// The readings among its neighbours. Symmetric only where both have six. For context only the 26.
  std::span<const Index> near(Index i) const {
    return std::span(neighbours_).subspan(first_[i], first_[i + 1] - first_[i]);
  }
  /// It is context, or some of its surroundings are not among the readings.
  bool at_border(Index i) const { return at_border_[i]; }
  /// The reading of a point, or none.
  Index find(PointId point) const {
    return index_of(point) < places_.size() ? places_[index_of(point)] : none;
  }
  /// The reading in a voxel, or none.
  Index find(geometry::VoxelKey key) const { return find(window_.find(key)); }
  /// visit(PointId, const VoxelPoint&) for the voxels of its cell, first the one whose point it is.
  template <class Visit>
  void for_each_voxel(Index i, Visit&& visit) const {
    cells_.for_each_voxel(readings_[i].point, [&](PointId voxel) { visit(voxel, voxels_[voxel]); });
  }
  /// Of a surface: its area in voxels over that in cells.
  double cells_a_voxel() const { return std::ldexp(1.0, -2 * cells_.map().level); }
  const sensing::ReadingModel& model() const { return model_; }
  double resolution() const { return grid_.resolution(); }
  const geometry::VoxelGrid& grid() const { return grid_; }

  double log_ratio(Index i, const Plane& plane) const { return model_.log_ratio(readings_[i], plane); }
  /// The same if it is positive, else 0.
  double gain(Index i, const Plane& plane) const {
    const Reading& r = readings_[i];
    return model_.gain(r.distance(plane), r.range_class, r.cos_incidence(plane));
  }
  /// Adds a reading to a patch's sums, weighted as a reading of the patch's plane; fits nothing.
  void add_to(Patch& patch, Index i) const;
  /// The patch of some readings and of sums `beyond` them, fitted with weights that depend on the plane,
  /// initially `about`.
  template <class Indices>
  Patch patch_of(const Indices& indices, const Plane& about, const Patch& beyond = {}) const;

 private:
  void add_moments(Patch& patch, Index i) const {  // what a fit needs, without a logarithm
    const Reading& r = readings_[i];
    patch.moments.add(r.position.cast<double>() - patch.origin,
                      model_.weight(r.range_class, r.cos_incidence(patch.plane)));
  }
  void add(std::vector<PointId> points);
  void find_neighbours(const occupancy::Neighbours& all, Index i);

  const surfaces::Cells& cells_;
  const occupancy::PointWindow& voxels_;
  const occupancy::PointWindow& window_;
  geometry::VoxelGrid grid_;
  sensing::ReadingModel model_;
  std::vector<Reading> readings_;
  std::size_t size_ = 0;
  std::vector<Index> places_;  // in `readings_`, by index in the window
  std::vector<bool> at_border_;
  std::vector<std::size_t> first_;  // in `neighbours_`
  std::vector<Index> neighbours_;
};

template <class Indices>
Patch Readings::patch_of(const Indices& indices, const Plane& about, const Patch& beyond) const {
  Patch patch;
  patch.plane = about;
  for (int round = 0; round < 2; ++round) {  // weights depend only to second order on the normal's change
    Patch next = beyond;
    next.plane = patch.plane;
    if (!(beyond.readings > 0))
      next.origin = readings_[*std::begin(indices)].position.template cast<double>();
    for (const Index i : indices) round == 0 ? add_moments(next, i) : add_to(next, i);
    next.fit();
    patch = next;
  }
  return patch;
}

}  // namespace octosurf::detection
