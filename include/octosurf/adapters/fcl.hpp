#pragma once

#include <cstddef>
#include <cstdint>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/octree/octree.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision_object.h>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <octosurf/adapters/octree.hpp>
#include <octosurf/surface.hpp>

// A map for FCL's collision checks: its octree, and its surfaces' meshes under a broad-phase manager that is
// updated incrementally. Needs FCL's and OctoMap's headers and libraries besides octosurf::octosurf.

namespace octosurf {

/// FCL's collision model of a triangle mesh.
using FclMesh = fcl::BVHModel<fcl::OBBRSSd>;

/// Converts any octosurf mesh, such as extrude(surface, 0.02), in its own coordinates.
inline std::shared_ptr<FclMesh> to_fcl_mesh(const Mesh& mesh) {
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  auto model = std::make_shared<FclMesh>();
  model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(mesh.vertices.size()));
  model->addSubModel(mesh.vertices, triangles);
  model->endModel();
  return model;
}

/// The octree of a view, or the part that meets a box (to_octree()): occupied voxels collide, unknown ones do
/// not. An fcl::OcTree only points to its octomap::OcTree: create it from one that you own, and
/// update_octree() updates both.
inline std::shared_ptr<fcl::OcTreed> to_fcl_octree(const OccupancyView& view,
                                                   const Eigen::AlignedBox3d& box = detail::everywhere()) {
  return std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(to_octree(view, box)));
}

/// The surfaces of a snapshot as collision objects under a broad-phase manager: each is the closed mesh of
/// extrude(), map frame.
///
/// 1. After update(snapshot) there is one object for each surface of the snapshot that has a polygon.
/// 2. Objects of surfaces with unchanged revision keep their address.
/// Cost of update(): O(surfaces), plus a mesh and its bounding-volume tree for each changed surface.
class FclSurfaces {
 public:
  /// `thickness` of the meshes against the normal, m.
  explicit FclSurfaces(double thickness = 0.02) : thickness_(thickness) {}
  FclSurfaces(const FclSurfaces&) = delete;
  FclSurfaces& operator=(const FclSurfaces&) = delete;

  /// Updates objects and manager to `snapshot`.
  void update(const Snapshot& snapshot) {
    for (auto entry = entries_.begin(); entry != entries_.end();)
      entry = snapshot.find(entry->first) == nullptr ? remove(entry) : std::next(entry);
    for (const SurfacePtr& surface : snapshot.surfaces) {
      const auto found = entries_.find(surface->id);
      if (found != entries_.end() && found->second.revision == surface->revision) continue;
      if (found != entries_.end()) remove(found);
      add(*surface);
    }
    manager_.setup();
  }

  /// For collision and distance queries; do not modify it.
  fcl::DynamicAABBTreeCollisionManagerd& manager() { return manager_; }
  std::size_t size() const { return entries_.size(); }  ///< number of objects
  /// nullptr if there is none.
  fcl::CollisionObjectd* object(SurfaceId id) const {
    const auto found = entries_.find(id);
    return found == entries_.end() ? nullptr : found->second.object.get();
  }
  /// The surface of one of these objects, for callbacks of the manager.
  static SurfaceId id_of(const fcl::CollisionObjectd& object) {
    return static_cast<SurfaceId>(reinterpret_cast<std::uintptr_t>(object.getUserData()));
  }

 private:
  struct Entry {
    std::uint64_t revision = 0;
    std::unique_ptr<fcl::CollisionObjectd> object;
  };
  using Entries = std::map<SurfaceId, Entry>;

  Entries::iterator remove(Entries::iterator entry) {
    manager_.unregisterObject(entry->second.object.get());
    return entries_.erase(entry);
  }
  void add(const Surface& surface) {
    const Mesh mesh = extrude(surface, thickness_);
    if (mesh.triangles.empty()) return;
    Entry entry{surface.revision, std::make_unique<fcl::CollisionObjectd>(to_fcl_mesh(mesh))};
    entry.object->setUserData(reinterpret_cast<void*>(std::uintptr_t{surface.id}));
    manager_.registerObject(entry.object.get());
    entries_.emplace(surface.id, std::move(entry));
  }

  double thickness_;
  Entries entries_;
  fcl::DynamicAABBTreeCollisionManagerd manager_;
};

}  // namespace octosurf
