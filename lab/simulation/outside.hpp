#pragma once

#include "simulation/mesh.hpp"
#include "simulation/random.hpp"
#include "simulation/ray_caster.hpp"
#include "simulation/scene.hpp"

#include <Eigen/Geometry>
#include <vector>

namespace octosurf::simulation {

/// The mesh as a scene of one object "terrain": one facet per triangle, in its order; without a path.
Scene scene_of(const TriangleMesh& mesh, const std::string& name);

/// Tells places that light from outside can reach from those enclosed by the mesh.
///
/// Terrains are heaps of boxes that stand in each other, some wound the wrong way, some without a bottom:
/// neither winding numbers nor counts of crossings tell what is solid there. What a sensor can never see is
/// told by paths of rays: from an enclosed place no path leaves the mesh's box, however often it turns.
class Outside {
 public:
  Outside(const TriangleMesh& mesh, const Scene& scene);

  /// True if some of 64 paths that start at `p` into the half space of `normal` and turn at random where they
  /// meet a triangle, 16 times at most, leave the mesh: two must, for a single one may have slipped through a
  /// crack a float wide. Deterministic. Costs up to a thousand rays, a few if the sky is near.
  bool reached_from(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const;

 private:
  std::vector<Eigen::Vector3d> normals_;
  RayCaster caster_;
  double reach_ = 0;   ///< m: longer than the mesh
  double offset_ = 0;  ///< m: how far off a triangle a path goes on
};

}  // namespace octosurf::simulation
