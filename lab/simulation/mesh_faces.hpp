#pragma once

#include "simulation/mesh.hpp"

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::simulation {

/// One side of a plane, and what of it can be seen from outside.
struct OpenPlane {
  std::string name;  ///< "terrain/level", "…/slope", "…/wall", "…/overhang"
  Eigen::Isometry3d T_scene_face = Eigen::Isometry3d::Identity();  ///< z = normal, towards the open side
  std::vector<Polygon> polygons;                                   ///< each a face of its own
};

/// The true faces of a mesh.
///
/// 1. A face is what is connected of one plane (coplanar.hpp), on one side of it; how triangles are wound
/// does not
///    matter: a sheet has two sides, and so has a box that one can look into through a missing triangle.
/// 2. Only what a place outside of all solids touches belongs to it (outside.hpp): what other parts stand on
/// or
///    reach through is cut out, and parts within others are no faces at all.
/// 3. Curved things are the plane pieces that the mesh makes of them.
struct MeshFaces {
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::vector<OpenPlane> planes;
  /// Per triangle, of `planes`: the one its front side (from which it runs counter-clockwise) belongs to, its
  /// back's.
  std::vector<std::array<std::size_t, 2>> plane_of_side;
  std::vector<Eigen::Vector3d> normals;  ///< of the triangles' front sides
};

/// Deterministic; about 10 ms for each plane of the mesh.
MeshFaces find_mesh_faces(const TriangleMesh& mesh);

}  // namespace octosurf::simulation
