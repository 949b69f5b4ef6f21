#pragma once

#include <memory>
#include <octomap/OcTree.h>

#include <octosurf/occupancy.hpp>

// A map's octree as an octomap::OcTree that readers keep while mapping goes on. Link octosurf::octomap.

namespace octosurf {

/// Follows the octree of a map that changes: after each scan an octomap::OcTree of it for any reader.
///
///   octosurf::OctomapFollower follower;
///   mapper.insert(scan);
///   follower.follow(mapper.map().octree());                     // in the thread that maps
///   std::shared_ptr<const octomap::OcTree> tree = follower.tree();  // in any
///
/// 1. A tree that a reader holds never changes: node by node it stays to_octree() (adapters/octree.hpp) of
///    the view that it was made of. Map frame, metres, OctoMap's keys; occupied is what the map counts as
///    occupied.
/// 2. Two trees are written in turn, each brought up to date by what has changed since. One that a reader
///    holds is left alone, and a third is made; one that is held beyond that stays its reader's alone.
/// 3. Readers never wait for a scan, and a scan never waits for a reader. Trees outlive the follower.
/// 4. After an exception, of an allocation say, tree() is the one before, and the next follow() catches up.
///
/// Memory: OctoMap's, some 62 B a leaf, for each of the two trees.
class OctomapFollower {
 public:
  OctomapFollower();
  OctomapFollower(OctomapFollower&&) noexcept;
  OctomapFollower& operator=(OctomapFollower&&) noexcept;
  ~OctomapFollower();

  /// The tree of `now`, which tree() gives from here on. The tree that is written is the one before the last,
  /// so it costs update_octree() of the changes of two scans: some 6 ms along a kitchen at 2 cm, whose tree
  /// of 237,000 leaves takes 9 ms to be made anew. From one thread at a time. Views may be of any map, in any
  /// order; what is made anew, as for another map or resolution, costs what to_octree() does. Throws
  /// Error(usage) for a view of nothing, which has no resolution.
  std::shared_ptr<const octomap::OcTree> follow(const OccupancyView& now);

  /// The tree of the last follow(); null before the first. From any thread, without a lock.
  std::shared_ptr<const octomap::OcTree> tree() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace octosurf
