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

/// A map's octree at one moment: never changes, cheap to copy and to keep, readable from any thread while
/// the map goes on. It shares with the map all that has not changed since (copy on write, some hundred
/// voxel bricks at a time): taking one costs a copy of the table of those blocks, some 10 µs for a million
/// voxels, and each block that a later scan touches is copied once.
///
/// Voxels are half-open cubes of edge resolution(); what lies on a face belongs to the higher one. All points
/// in the map frame, metres.
class OccupancyView {
 public:
  /// What is known of a voxel: unknown until a ray has ended in it or passed through it.
  enum class State { unknown, free, occupied };

  /// All that a view has of a voxel.
  struct Voxel {
    State state = State::unknown;  ///< by `log_odds` and the map's parameters
    float log_odds = 0;            ///< ln(p / (1 − p)) of its being occupied; 0 if unknown
    SurfaceId surface = 0;         ///< of an occupied voxel: whose it is; 0: pending, or not occupied
    Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< map frame
  };

  /// Nothing known, anywhere.
  OccupancyView();
  /// For src/occupancy, which makes them.
  OccupancyView(std::shared_ptr<const occupancy::VoxelTree> tree, double resolution);

  double resolution() const { return resolution_; }  ///< d; 0 if nothing is known
  /// Log-odds from which a voxel counts as occupied; 0 if nothing is known.
  float occupied_from() const;

  /// The voxel that holds `point`; unknown outside the octree's range. O(depth), some 50 ns.
  Voxel at(const Eigen::Vector3d& point) const;

  /// The first voxel that stops the straight way from `from` to `to`, in its order: an occupied one, or an
  /// unknown one too if `unknown_stops`. The voxel of `from` itself counts. Nothing if there is none. Throws
  /// Error(usage) if a point is not finite. O(voxels passed), some 10 ns each; large free cubes in one step.
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
  /// How many voxels with their centre in `box` are in each state. O(nodes that the box meets).
  Count count(const Eigen::AlignedBox3d& box) const;

  /// A voxel, and how far it is.
  struct Near {
    Voxel voxel;          ///< the nearest
    double distance = 0;  ///< m, to its centre
  };
  /// The occupied voxel whose centre is nearest to `point`, and how far that is, if not beyond `limit` m; of
  /// several the one first in Morton order. Throws Error(usage) if `point` or `limit` is not finite.
  std::optional<Near> nearest_occupied(const Eigen::Vector3d& point, double limit) const;

  /// A cube of one value, as OctoMap's octree would have it: pruned wherever eight are equal.
  struct Leaf {
    std::array<std::uint16_t, 3> corner{};  ///< OctoMap's key of its lowest voxel; 32768 begins at 0 m
    std::uint8_t level = 0;                 ///< its edge is 2^level voxels
    float log_odds = 0;                     ///< of every voxel in it
  };
  /// Takes leaves, valid during the call.
  using VisitLeaves = std::function<void(std::span<const Leaf>)>;

  /// Calls `visit` with all leaves in Morton order, some thousands at a time. O(nodes), a few ns each.
  void for_each_leaf(const VisitLeaves& visit) const;
  /// With those that meet `box` (closed); where it cuts a pruned cube, with what of that meets it.
  void for_each_leaf(const Eigen::AlignedBox3d& box, const VisitLeaves& visit) const;

  /// What stands behind the header of the map's .bt, which is what octomap_msgs sends of a tree at maximum
  /// likelihood and pruned: two bits for a child. O(nodes), some ns each.
  std::string octomap_data() const;

  /// A cube whose leaves are not what they were: these replace all that was in it; none if nothing is known
  /// there any longer.
  struct Change {
    std::array<std::uint16_t, 3> corner{};  ///< as a Leaf's
    std::uint8_t level = 0;                 ///< as a Leaf's
    std::span<const Leaf> leaves;           ///< Morton order, valid during the call
  };
  /// Calls `visit` with what has changed since `before`, a view of the same map, in Morton order; disjoint
  /// cubes of 2³ voxels or more. O(cubes of 4³ voxels that scans in between wrote to); of views of two maps,
  /// which it compares as well, O(nodes of both). Throws Error(usage) if the resolutions differ.
  void for_each_change(const OccupancyView& before, const std::function<void(const Change&)>& visit) const;

 private:
  Voxel voxel(const geometry::VoxelKey& key) const;

  std::shared_ptr<const occupancy::VoxelTree> tree_;
  double resolution_ = 0;
};

}  // namespace octosurf
