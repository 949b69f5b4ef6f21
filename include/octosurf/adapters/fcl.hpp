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

// A map for FCL's collision checks: its octree, and its surfaces' meshes with a broad-phase manager that is
// kept up to date. Needs FCL's and OctoMap's headers and libraries beside octosurf::octosurf.

namespace octosurf {

/// A triangle mesh as FCL collides it.
using FclMesh = fcl::BVHModel<fcl::OBBRSSd>;

/// Any mesh of octosurf's, such as extrude(surface, 0.02), in its own coordinates.
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

/// The octree of a view, or what of it meets a box (to_octree()): what is occupied collides, what is unknown
/// does not. An fcl::OcTree only points to its octomap::OcTree: make it of one that you hold, and
/// update_octree() keeps both up to date.
inline std::shared_ptr<fcl::OcTreed> to_fcl_octree(const OccupancyView& view,
                                                   const Eigen::AlignedBox3d& box = detail::everywhere()) {
  return std::make_shared<fcl::OcTreed>(std::shared_ptr<const octomap::OcTree>(to_octree(view, box)));
}

/// The surfaces of a snapshot as collision objects under a broad-phase manager: each the closed mesh of
/// extrude(), map frame.
///
/// 1. After update(snapshot) there is one object for each surface of the snapshot that has a polygon.
/// 2. Objects of surfaces whose revision is the same stay; so does the address of their object.
/// Cost of update(): O(surfaces), and a mesh and its box tree for each that changed.
class FclSurfaces {
 public:
  /// `thickness` of the meshes against the normal, m.
  explicit FclSurfaces(double thickness = 0.02) : thickness_(thickness) {}
  FclSurfaces(const FclSurfaces&) = delete;
  FclSurfaces& operator=(const FclSurfaces&) = delete;

  /// Brings objects and manager to what `snapshot` has.
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

  /// To be asked for collisions and distances; not to be changed.
  fcl::DynamicAABBTreeCollisionManagerd& manager() { return manager_; }
  std::size_t size() const { return entries_.size(); }  ///< number of objects
  /// nullptr if there is none.
  fcl::CollisionObjectd* object(SurfaceId id) const {
    const auto found = entries_.find(id);
    return found == entries_.end() ? nullptr : found->second.object.get();
  }
  /// Of one of these objects, in a callback of the manager.
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
