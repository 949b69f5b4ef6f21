#include "simulation/faces.hpp"

#include "geometry/even_odd.hpp"
#include "simulation/planar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <octosurf/error.hpp>

namespace octosurf::simulation {
namespace {

constexpr std::size_t no_group = std::numeric_limits<std::size_t>::max();

Eigen::Isometry3d frame_of(const Facet& facet) {
  const auto& ring = facet.ring;
  return face_frame((ring[1] - ring[0]).cross(ring[2] - ring[0]).normalized(), ring[0]);
}

bool same_plane(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Vector3d n = a.linear().col(2);
  return n.dot(b.linear().col(2)) > 1 - 1e-10 && std::abs(n.dot(b.translation() - a.translation())) < 1e-7;
}

/// Groups of all planar facets, object by object, and each facet's group.
std::vector<PlanarGroup> group_facets(const Scene& scene, std::vector<std::size_t>& group_of_facet) {
  std::vector<PlanarGroup> groups;
  std::map<std::size_t, std::vector<std::size_t>> of_object;
  for (const auto& solid : scene.solids)
    for (const auto& facet : solid.facets) {
      group_of_facet.push_back(no_group);
      if (facet.curved) continue;
      const Eigen::Isometry3d T = frame_of(facet);
      auto& candidates = of_object[solid.object];
      for (const auto g : candidates)
        if (same_plane(groups[g].T_scene_face, T)) group_of_facet.back() = g;
      if (group_of_facet.back() == no_group) {
        group_of_facet.back() = groups.size();
        candidates.push_back(groups.size());
        groups.push_back({solid.object, scene.objects[solid.object].name + "/" + facet.name, T, {}});
      }
      groups[group_of_facet.back()].facets.push_back(&facet);
    }
  return groups;
}

/// Of the facets, with room for what only touches them.
Eigen::AlignedBox3d bounds(const std::vector<const Facet*>& facets) {
  constexpr double margin = 1e-3;
  Eigen::AlignedBox3d box;
  for (const auto* facet : facets)
    for (const auto& vertex : facet->ring) box.extend(vertex);
  return {box.min().array() - margin, box.max().array() + margin};
}

std::vector<Eigen::AlignedBox3d> solid_bounds(const Scene& scene) {
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const auto& solid : scene.solids) {
    std::vector<const Facet*> facets;
    for (const auto& facet : solid.facets) facets.push_back(&facet);
    boxes.push_back(bounds(facets));
  }
  return boxes;
}

void scale(Polygon& polygon, double factor) {
  for (auto& p : polygon.outer) p *= factor;
  for (auto& hole : polygon.holes)
    for (auto& p : hole) p *= factor;
}

double distance_to_ring(const Ring2& ring, const Eigen::Vector2d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Eigen::Vector2d edge = ring[i] - ring[j];
    const double along = std::clamp(edge.dot(p - ring[j]) / edge.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (ring[j] + along * edge - p).norm());
  }
  return best;
}

}  // namespace

bool contains(const Polygon& polygon, const Eigen::Vector2d& p) {
  if (!geometry::inside(polygon.outer, p)) return false;
  for (const auto& hole : polygon.holes)
    if (geometry::inside(hole, p)) return false;
  return true;
}

Faces::Faces(const Scene& scene, const Similarity& T_map_scene) {
  const auto groups = group_facets(scene, group_of_facet_);
  const auto boxes = solid_bounds(scene);
  for (const auto& group : groups) {
    const bool gone = !scene.objects[group.object].stands[1];
    const Eigen::AlignedBox3d reach = bounds(group.facets);
    std::vector<const Solid*> covers;
    for (std::size_t s = 0; s < scene.solids.size(); ++s)
      if (scene.objects[scene.solids[s].object].stands[gone ? 0 : 1] && boxes[s].intersects(reach))
        covers.push_back(&scene.solids[s]);
    add_group({group.name, group.T_scene_face, open_area(group, covers)}, gone, T_map_scene);
  }
  check_count("choose a shorter corridor");
}

Faces::Faces(const MeshFaces& mesh, const Similarity& T_map_scene) {
  for (const auto& plane : mesh.planes) add_group(plane, false, T_map_scene);
  static_assert(MeshFaces::none == no_group);
  for (const auto& [front, back] : mesh.plane_of_side) {
    group_of_facet_.push_back(front);
    group_of_back_.push_back(back);
  }
  for (const auto& normal : mesh.normals) normals_.emplace_back(T_map_scene.R * normal);
  check_count("simplify the mesh, or cut a part out of it");
}

void Faces::add_group(const OpenPlane& plane, bool gone, const Similarity& T_map_scene) {
  evaluation::TrueFace face;
  face.T_map_face.linear() = T_map_scene.R * plane.T_scene_face.linear();
  face.T_map_face.translation() = T_map_scene * plane.T_scene_face.translation();
  face.plane.normal = face.T_map_face.linear().col(2);
  face.plane.offset = face.plane.normal.dot(face.T_map_face.translation());
  face.gone = gone;
  groups_.push_back({faces_.size(), plane.polygons.size()});
  for (Polygon polygon : plane.polygons) {
    scale(polygon, T_map_scene.scale);
    face.id = static_cast<std::uint32_t>(faces_.size() + 1);
    const int same_name = ++names_[plane.name];
    face.name = plane.name;
    if (same_name > 1) face.name.append("#").append(std::to_string(same_name));
    Eigen::AlignedBox2d box;
    for (const auto& p : polygon.outer) box.extend(p);
    face.polygons = {std::move(polygon)};
    faces_.push_back(face);
    bounds_.push_back(box);
  }
}

void Faces::check_count(const std::string& hint) const {
  if (faces_.size() > std::numeric_limits<std::uint16_t>::max())
    throw Error(Error::Kind::usage, "scene", "has more faces than 16-bit labels can name", hint);
}

std::uint16_t Faces::label(std::size_t facet, const Eigen::Vector3d& point,
                           const Eigen::Vector3d& direction) const {
  const bool back = !group_of_back_.empty() && normals_[facet].dot(direction) > 0;
  const std::size_t g = back ? group_of_back_[facet] : group_of_facet_[facet];
  if (g == no_group || groups_[g].count == 0) return 0;
  const auto [first, count] = groups_[g];
  const auto id = [](std::size_t index) { return static_cast<std::uint16_t>(index + 1); };
  if (count == 1) return id(first);
  const Eigen::Vector2d p = (faces_[first].T_map_face.inverse() * point).head<2>();
  // Mostly one face's bounds hold the point, which spares the walk along its rings.
  std::size_t held_by = 0;
  std::size_t last = first;
  for (std::size_t i = first; i < first + count; ++i)
    if (bounds_[i].contains(p)) {
      ++held_by;
      last = i;
    }
  if (held_by == 1) return id(last);
  for (std::size_t i = first; i < first + count; ++i)
    if (bounds_[i].contains(p) && contains(faces_[i].polygons[0], p)) return id(i);
  // On an edge, or on what was covered later: the nearest face of the plane.
  std::size_t best = first;
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = first; i < first + count; ++i)
    if (const double d = distance_to_ring(faces_[i].polygons[0].outer, p); d < best_distance) {
      best = i;
      best_distance = d;
    }
  return id(best);
}

}  // namespace octosurf::simulation
