#pragma once

#include "detection/patch.hpp"
#include "occupancy/point_window.hpp"
#include "sensing/reading_model.hpp"

#include <Eigen/Core>
#include <boost/container/small_vector.hpp>
#include <cstdint>
#include <span>
#include <vector>

namespace octosurf::detection {

/// Which plane a reading belongs to: a place in a list of patches. 0 is clutter, and no patch.
using Label = std::uint32_t;
inline constexpr Label clutter = 0;

/// Voxels whose points are looked at together.
struct Neighbourhood {
  std::vector<geometry::VoxelKey> voxels;    ///< are labelled, and planes are looked for among them
  std::vector<geometry::VoxelKey> may_join;  ///< were no plane before: are labelled, but seed no plane
  std::vector<geometry::VoxelKey> context;   ///< keep the label they have; others meet them
  std::vector<geometry::VoxelKey> rims;      ///< the same at the rim of their surface: met across gaps
};

/// Voxels, how far neighbours are looked for where points are sparse: within `reach` m, at least one.
int farthest_neighbour(double resolution, double reach);
/// The points around one: the 26, or where fewer than six of these hold a point, those within as few voxels
/// as bring six, at most `farthest`.
using NearPoints = boost::container::small_vector<occupancy::PointWindow::Index, 26>;
NearPoints near_points(const occupancy::PointWindow& window, geometry::VoxelKey key, int farthest);

/// What the octree keeps of the scans in one voxel.
struct Reading {
  geometry::VoxelKey key;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f view = Eigen::Vector3f::UnitZ();  ///< unit, toward the sensor
  std::uint8_t range_class = 0;
  bool may_seed = true;   ///< planes may begin with it
  bool at_rim = false;    ///< of context: its surface ends beside it
  float hits = 1;         ///< scans that hit the voxel, as far as its log-odds tell (at most some four)
  SurfaceId surface = 0;  ///< that has it so far
  occupancy::PointWindow::Index in_window = 0;

  double facing(const Plane& plane) const { return plane.normal.dot(view.cast<double>()); }
  double distance(const Plane& plane) const { return plane.signed_distance(position.cast<double>()); }
};

/// Points of an octree, owned and pending alike, with their neighbours among each other: all of the octree's,
/// or a neighbourhood's. After those that are to be labelled comes their context. Each
/// part is in order of its blocks of 8³ voxels, and in these of their keys, whatever the window has loaded
/// first.
class Readings {
 public:
  using Index = occupancy::PointWindow::Index;
  static constexpr Index none = occupancy::PointWindow::none;

  /// All points, which are loaded into `window`. O(points).
  Readings(const occupancy::OccupancyMap& octree, const occupancy::PointWindow& window,
           const sensing::NoiseModel& noise);
  /// The points of some voxels. O(voxels), but for a word for each point that the window has loaded.
  Readings(const occupancy::OccupancyMap& octree, const occupancy::PointWindow& window,
           const Neighbourhood& around, const sensing::NoiseModel& noise);

  /// Those to be labelled; what has an index from here on is context.
  std::size_t size() const { return size_; }
  std::size_t size_with_context() const { return readings_.size(); }
  /// True for `none`, too.
  bool is_context(Index i) const { return i >= size_; }
  const Reading& operator[](Index i) const { return readings_[i]; }
  /// The readings of near_points() within farthest_reach. Symmetric only where both have six. Of context the
  /// 26 alone.
  static constexpr double farthest_reach = 0.16;  ///< m; effort
  std::span<const Index> near(Index i) const {
    return std::span(neighbours_).subspan(first_[i], first_[i + 1] - first_[i]);
  }
  /// It is context, or some of what lies around it is not among the readings.
  bool at_border(Index i) const { return at_border_[i]; }
  /// The reading in a voxel, or none.
  Index find(geometry::VoxelKey key) const { return of_window(window_.find(key)); }
  const sensing::ReadingModel& model() const { return model_; }
  double resolution() const { return grid_.resolution(); }
  const geometry::VoxelGrid& grid() const { return grid_; }

  double log_ratio(Index i, const Plane& plane) const {
    const Reading& r = readings_[i];
    return model_.log_ratio(r.distance(plane), r.range_class, r.facing(plane));
  }
  /// The same if it is positive, else 0.
  double gain(Index i, const Plane& plane) const {
    const Reading& r = readings_[i];
    return model_.gain(r.distance(plane), r.range_class, r.facing(plane));
  }
  /// Adds a reading to a patch's sums, weighted as a reading of the patch's plane; fits nothing.
  void add_to(Patch& patch, Index i) const;
  /// The patch of some readings and of sums `beyond` them, fitted by weights that follow the plane, which
  /// starts as `about`.
  template <class Indices>
  Patch patch_of(const Indices& indices, const Plane& about, const Patch& beyond = {}) const;

 private:
  void add(std::span<const geometry::VoxelKey> keys, std::span<const geometry::VoxelKey> others,
           const occupancy::OccupancyMap& octree);
  void find_neighbours(Index i);
  Index of_window(Index in_window) const { return in_window < places_.size() ? places_[in_window] : none; }

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
  for (int round = 0; round < 2; ++round) {  // weights move by the square of what the normal does
    Patch next = beyond;
    next.plane = patch.plane;
    if (!(beyond.readings > 0))
      next.origin = readings_[*std::begin(indices)].position.template cast<double>();
    for (const Index i : indices) add_to(next, i);
    next.fit();
    patch = next;
  }
  return patch;
}

}  // namespace octosurf::detection
