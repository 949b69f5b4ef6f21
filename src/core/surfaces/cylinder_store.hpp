#pragma once

#include "geometry/cylinder_fit.hpp"
#include "surfaces/model_store.hpp"
#include "surfaces/surface_model.hpp"

#include <map>
#include <set>
#include <tsl/robin_map.h>
#include <vector>

#include <octosurf/cylinder.hpp>

namespace octosurf::surfaces {

/// The working form of a cylinder: its shape and the pending voxels that support it.
struct CylinderModel {
  CylinderId id = 0;
  geometry::CylinderShape shape;
  std::map<geometry::VoxelKey, Inlier> inliers;  ///< with their points as in the octree
  std::uint64_t unchecked = 0;                   ///< inliers added, removed or moved since the last fit
  std::uint64_t born = 0;                        ///< map revision in which it was first published
  std::uint64_t revision = 0;                    ///< map revision of the last published change
  CylinderPtr published;                         ///< null before the first publication

  /// The immutable form for readers. O(inliers).
  CylinderPtr publish(std::uint64_t map_revision) const;
};

/// All cylinders. A pending voxel supports at most one; it leaves when it vanishes or a surface takes it.
///
/// Unchanged cylinders keep their published form, so the cost follows the change.
class CylinderStore : public ModelStore<CylinderModel, CylinderModel> {
 public:
  CylinderModel& create(const geometry::CylinderShape& shape);
  CylinderModel& restore(CylinderModel model);
  /// Frees its voxels; `into` is the cylinder that absorbed it, if any.
  void erase(CylinderId id, CylinderId into = 0);
  static CylinderId free_id(CylinderId first);  ///< that one; throws Error(data) if there is none

  /// The cylinder that the voxel supports, or 0. O(1).
  CylinderId owner(geometry::VoxelKey key) const {
    if (owners_.empty()) return 0;
    const auto found = owners_.find(key.packed());
    return found == owners_.end() ? 0 : found->second;
  }
  void add(CylinderModel& cylinder, const Inlier& inlier);  ///< removes it from its present cylinder, if any
  void release(geometry::VoxelKey key);                     ///< no-op if it supports none
  void move(const Inlier& inlier);                          ///< after a closer view; no-op likewise

  /// Starts recording the previous state until commit() or roll_back(): copies each cylinder that is changed.
  void begin_changes();
  void commit() noexcept;
  /// Restores the state at begin_changes(). Changes nothing if it throws, and can be called again. O(inliers
  /// of all).
  void roll_back();

  /// Cylinders whose inliers changed since publication; ascending.
  const std::set<CylinderId>& touched() const { return touched_; }
  /// All in order of id; publishes the touched ones and clears the mark.
  std::vector<CylinderPtr> publish(std::uint64_t map_revision);

 private:
  tsl::robin_map<std::uint64_t, CylinderId, geometry::PackedKeyHash> owners_;
  std::set<CylinderId> touched_;
  std::set<CylinderId> touched_before_;  // at begin_changes()
};

}  // namespace octosurf::surfaces
