#include "geometry/disjoint_sets.hpp"
#include "geometry/triangulate.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <tuple>

#include <octosurf/error.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr std::size_t next_corner(std::size_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

// The edge from `corner` to the next one of its triangle, with an undirected key.
struct MeshEdge {
  std::uint32_t low, high;
  std::size_t corner;
};

// One polygon's top, bottom and walls. Corners of triangles that share an edge are one vertex; corners that
// only touch in a point (rings that share a vertex) become separate vertices, otherwise the wall's edge there
// would be in four triangles.
void add_prism(const Triangles& triangles, const std::vector<Eigen::Vector2d>& points, const Surface& surface,
               double thickness, Mesh& mesh) {
  if (triangles.empty()) return;
  std::vector<MeshEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t corner = 0; corner < 3 * triangles.size(); ++corner) {
    const std::uint32_t from = triangles[corner / 3][corner % 3];
    const std::uint32_t to = triangles[corner / 3][next_corner(corner) % 3];
    edges.push_back({std::min(from, to), std::max(from, to), corner});
  }
  std::sort(edges.begin(), edges.end(), [](const MeshEdge& a, const MeshEdge& b) {
    return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
  });

  geometry::DisjointSets sets(3 * triangles.size());
  std::vector<std::size_t> boundary;  // corners whose edge has no triangle on its other side
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool paired =
        i + 1 < edges.size() && edges[i].low == edges[i + 1].low && edges[i].high == edges[i + 1].high;
    if (!paired) {
      boundary.push_back(edges[i].corner);
      continue;
    }
    const std::size_t a = edges[i].corner, b = edges[i + 1].corner;
    sets.join(a, next_corner(b));
    sets.join(next_corner(a), b);
    ++i;
  }

  // Vertex 2k lies on the plane, 2k + 1 below it.
  constexpr std::uint32_t none = 0xffffffffu;
  std::vector<std::uint32_t> top(3 * triangles.size(), none);
  for (std::size_t corner = 0; corner < top.size(); ++corner) {
    std::uint32_t& index = top[sets.root(corner)];
    if (index == none) {
      index = static_cast<std::uint32_t>(mesh.vertices.size());
      const Eigen::Vector3d point = surface.to_map(points[triangles[corner / 3][corner % 3]]);
      mesh.vertices.push_back(point);
      mesh.vertices.push_back(point - thickness * surface.plane.normal);
    }
    top[corner] = index;
  }
  for (std::size_t corner = 0; corner < top.size(); corner += 3) {
    mesh.triangles.push_back({top[corner], top[corner + 1], top[corner + 2]});
    mesh.triangles.push_back({top[corner + 2] + 1, top[corner + 1] + 1, top[corner] + 1});
  }
  for (const std::size_t corner : boundary) {
    const std::uint32_t a = top[corner], b = top[next_corner(corner)];
    mesh.triangles.push_back({b, a, a + 1});
    mesh.triangles.push_back({b, a + 1, b + 1});
  }
}

}  // namespace

Mesh extrude(const Surface& surface, double thickness) {
  if (!std::isfinite(thickness) || thickness <= 0) {
    throw Error(Error::Kind::usage, "mesh_thickness", std::to_string(thickness) + " is not greater than 0",
                "give a thickness in metres, such as 0.02");
  }
  Mesh mesh;
  std::vector<Eigen::Vector2d> points;
  for (const Polygon& polygon : surface.polygons) {
    const Triangles triangles = geometry::triangulate(polygon, points);
    add_prism(triangles, points, surface, thickness, mesh);
  }
  return mesh;
}

}  // namespace octosurf
