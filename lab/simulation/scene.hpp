#pragma once

#include "evaluation/truth.hpp"
#include "simulation/random.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::simulation {

/// One side of a solid: a convex planar ring, counter-clockwise seen from outside.
struct Facet {
  std::vector<Eigen::Vector3d> ring;
  std::string name;     ///< "top", "front", …
  bool curved = false;  ///< approximates a curved thing: no true face, label 0
};

/// A convex polyhedron (concave things are several solids of one object), or all triangles of a mesh.
struct Solid {
  std::size_t object = 0;
  std::vector<Facet> facets;
};

/// What is put, moved or taken as a whole. Adjoining coplanar facets of one object are one face.
struct Object {
  std::string name;
  std::array<bool, 2> stands{true, true};  ///< before and after the change midway
};

/// Where the head is and what it looks at.
struct View {
  Eigen::Vector3d eye;
  Eigen::Vector3d target;
};

/// A place in its own frame: metres, z up, the floor's top at z = 0.
struct Scene {
  std::string name;
  std::vector<Object> objects;
  std::vector<Solid> solids;
  std::vector<evaluation::TrueStair> stairs;
  bool of_stairs =
      false;  ///< made of one stair: walked slowly, and never scaled, so that it is as high as it says
  std::vector<View> path;  ///< key views of one lap, walked in order

  bool changes() const;  ///< true if some object does not stand all the time
};

/// Names that make_scene knows.
std::vector<std::string> scene_names();

/// `random` varies dimensions and places; `length` (m) is that of the corridor, unused elsewhere.
/// Throws Error(usage) for an unknown name.
Scene make_scene(const std::string& name, Random random, double length);

// Building blocks. Boxes' facets: left −x, right +x, front −y, back +y, bottom, top.

std::size_t add_object(Scene& scene, const std::string& name, bool before = true, bool after = true);
void add_box(Scene& scene, std::size_t object, const Eigen::Vector3d& min, const Eigen::Vector3d& max);
/// Box of `size` centred on T's origin.
void add_box(Scene& scene, std::size_t object, const Eigen::Isometry3d& T, const Eigen::Vector3d& size);
/// Convex `base` (counter-clockwise, in T's x and y) extruded along T's z by `height`.
void add_prism(Scene& scene, std::size_t object, const Eigen::Isometry3d& T, const Ring2& base, double height,
               bool curved = false);
/// Upright; the lateral surface is curved, bottom and top are faces.
void add_cylinder(Scene& scene, std::size_t object, const Eigen::Vector3d& base, double radius,
                  double height);
void add_sphere(Scene& scene, std::size_t object, const Eigen::Vector3d& center, double radius);

/// An opening from `from` to `to` along a wall, `height` above the floor.
struct Door {
  double from = 0;
  double to = 0;
  double height = 2.05;
};
/// Wall along x over [min, max], standing on the floor, with doors (ascending, not touching).
void add_wall(Scene& scene, std::size_t object, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
              const std::vector<Door>& doors = {});

}  // namespace octosurf::simulation
