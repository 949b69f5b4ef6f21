#pragma once

#include "simulation/mesh.hpp"

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace octosurf::simulation {

/// Triangles of a mesh in one plane, whichever way they are wound and whether they touch or not.
struct CoplanarTriangles {
  Eigen::Isometry3d T_scene_plane =
      Eigen::Isometry3d::Identity();  ///< z = the plane's normal, of either sign
  std::vector<std::size_t> triangles;
};

/// How far corners of one plane may lie off it, m: half a millimetre, because a depth image holds whole ones,
/// so that no recording tells apart two planes that touch and are nearer; more where the mesh is less
/// precise. (It is far below what a mapper separates, 15 mm at d = 2 cm: two steps 3 mm apart stay two true
/// faces.)
double coplanar_tolerance(const TriangleMesh& mesh);

/// Each triangle in exactly one plane; planes with the largest triangle first. Pieces grow from triangle to
/// triangle over shared edges, and pieces of one plane are put together: corners within coplanar_tolerance()
/// of the least-squares plane, normals within 5° (a corner's worth of a small triangle lies near any plane).
std::vector<CoplanarTriangles> coplanar_triangles(const TriangleMesh& mesh);

}  // namespace octosurf::simulation
