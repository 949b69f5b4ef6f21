#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <octosurf/ids.hpp>

namespace octosurf::occupancy {
class VoxelTree;
}  // namespace octosurf::occupancy

namespace octosurf::geometry {
struct VoxelKey;
}  // namespace octosurf::geometry

namespace octosurf {

/// A map's octree at one moment: immutable, cheap to copy and keep, readable from any thread while mapping
/// continues. Shares unchanged blocks with the map (copy on write, some hundred voxel bricks each): taking a
/// view copies the table of blocks, some 10 µs for a million voxels, and each block that a later scan writes
/// to is copied once.
///
/// Voxels are half-open cubes of edge resolution(); a point on a face belongs to the higher voxel. All points
/// in the map frame, metres.
class OccupancyView {
 public:
  /// State of a voxel: unknown until a ray ends in it or passes through it.
  enum class State { unknown, free, occupied };

  /// All data of a voxel in a view.
  struct Voxel {
    State state = State::unknown;                      ///< by `log_odds` and the map's parameters
    float log_odds = 0;                                ///< ln(p / (1 − p)) of occupancy; 0 if unknown
    SurfaceId surface = 0;                             ///< of an occupied voxel; 0: pending, or not occupied
    Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< map frame
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< stands for its readings, map frame; else the centre
    Eigen::Vector3d view = Eigen::Vector3d::Zero();   ///< unit, from `point` to the sensor, to 4°; else zero
    float range_m = 0;                                ///< from there, to 20 %; else zero
  };

  /// An empty view: everything is unknown.
  OccupancyView();
  /// Used by src/core/occupancy.
  OccupancyView(std::shared_ptr<const occupancy::VoxelTree> tree, double resolution);
  const occupancy::VoxelTree* tree() const { return tree_.get(); }  ///< likewise; null: empty

  double resolution() const { return resolution_; }  ///< d; 0 for an empty view
  /// Log-odds from which a voxel counts as occupied; 0 for an empty view.
  float occupied_from() const;

  /// The voxel that holds `point`; unknown outside the octree's range. O(depth), some 50 ns.
  Voxel at(const Eigen::Vector3d& point) const;

  /// The first voxel that blocks the straight path from `from` to `to`: an occupied one, or also an unknown
  /// one if `unknown_stops`. The voxel of `from` counts. Empty if the path is clear. Throws Error(usage) if a
  /// point is not finite. O(voxels passed), some 10 ns each; large free cubes in one step.
  std::optional<Voxel> first_on_way(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                    bool unknown_stops = false) const;

  /// Calls `visit` for every occupied voxel whose centre lies in `box` (closed), in Morton order, until it
  /// returns false. O(nodes that the box meets).
  void for_each_occupied(const Eigen::AlignedBox3d& box,
                         const std::function<bool(const Voxel&)>& visit) const;

  /// Voxels by State.
  struct Count {
    std::size_t unknown = 0;   ///< no ray reached them
    std::size_t free = 0;      ///< rays passed through them
    std::size_t occupied = 0;  ///< rays ended in them
  };
  /// Number of voxels with their centre in `box`, by state. O(nodes that the box meets).
  Count count(const Eigen::AlignedBox3d& box) const;

  /// The occupied voxel with the centre nearest to `point`, within `limit` m; on a tie the first in Morton
  /// order. Throws Error(usage) if `point` or `limit` is not finite.
  std::optional<Voxel> nearest_occupied(const Eigen::Vector3d& point, double limit) const;

  /// A cube of one value, as in OctoMap's octree: pruned wherever eight are equal.
  struct Leaf {
    std::array<std::uint16_t, 3> corner{};  ///< OctoMap's key of its lowest voxel; 32768 begins at 0 m
    std::uint8_t level = 0;                 ///< its edge is 2^level voxels
    float log_odds = 0;                     ///< of every voxel in it
  };
  /// Receives leaves, valid during the call.
  using VisitLeaves = std::function<void(std::span<const Leaf>)>;

  /// Calls `visit` with all leaves in Morton order, some thousands at a time. O(nodes), a few ns each.
  void for_each_leaf(const VisitLeaves& visit) const;
  /// Only leaves that meet `box` (closed); a pruned cube that the box cuts is split into the parts that meet
  /// it.
  void for_each_leaf(const Eigen::AlignedBox3d& box, const VisitLeaves& visit) const;

  /// The body of the map's .bt, as octomap_msgs sends it: maximum likelihood, pruned, two bits for a child;
  /// or `full`, of its .ot: log-odds. Only of cubes that meet `box`, unless that is empty. O(nodes that it
  /// meets), some ns each.
  std::string octomap_data(const Eigen::AlignedBox3d& box = {}, bool full = false) const;

  /// Receives a cube, as a Leaf's, and the leaves that replace all its previous contents, in Morton order and
  /// valid during the call; none if the cube became unknown.
  using VisitChange = std::function<void(const std::array<std::uint16_t, 3>& corner, std::uint8_t level,
                                         std::span<const Leaf> leaves)>;
  /// Calls `visit` with all changes since `before`, a view of the same map, in Morton order; disjoint cubes
  /// of 2³ voxels or more. O(cubes of 4³ voxels written in between). Also compares views of two maps, in
  /// O(nodes of both). Throws Error(usage) if the resolutions differ.
  void for_each_change(const OccupancyView& before, const VisitChange& visit) const;

  /// Calls `visit` with corner and level of each cube in which the state, surface or point of some voxel is
  /// not as in `before`; disjoint, of 4³ voxels or more. Cost and errors as for_each_change().
  void for_each_changed_cube(
      const OccupancyView& before,
      const std::function<void(const std::array<std::uint16_t, 3>& corner, int level)>& visit) const;

 private:
  Voxel voxel(const geometry::VoxelKey& key) const;

  std::shared_ptr<const occupancy::VoxelTree> tree_;
  double resolution_ = 0;
};

}  // namespace octosurf
