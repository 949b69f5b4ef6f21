#include "support/alpha_shape_twin.hpp"

#include "geometry/disjoint_sets.hpp"
#include "geometry/rings.hpp"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <array>
#include <map>
#include <unordered_map>

namespace octosurf {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

struct FaceMark {
  bool kept = false;
  std::size_t number = 0;        // among those kept
  std::array<bool, 3> walked{};  // boundary edge opposite vertex i is on a ring already
};
using VertexBase = CGAL::Triangulation_vertex_base_2<Kernel>;
using FaceBase = CGAL::Triangulation_face_base_with_info_2<FaceMark, Kernel>;
using Delaunay =
    CGAL::Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>>;
using Face = Delaunay::Face_handle;
using Vertex = Delaunay::Vertex_handle;

bool has_long_side(const Face& face, double alpha) {
  const auto is_long = [&](int i) {
    return CGAL::squared_distance(face->vertex(i)->point(), face->vertex(Delaunay::ccw(i))->point()) >
           alpha * alpha;
  };
  return is_long(0) || is_long(1) || is_long(2);
}

/// Boundary edge of a kept triangle: opposite its vertex `index`, interior on the left.
struct BoundaryEdge {
  Face face;
  int index;

  Vertex from() const { return face->vertex(Delaunay::ccw(index)); }
  Vertex to() const { return face->vertex(Delaunay::cw(index)); }
};

/// The next boundary edge: turn about `to()` through kept triangles until one has no kept neighbour.
BoundaryEdge next_edge(const BoundaryEdge& edge) {
  const Vertex pivot = edge.to();
  Face face = edge.face;
  for (;;) {
    const int pivot_index = face->index(pivot);
    const int out = Delaunay::cw(pivot_index);  // opposite it lies the edge that leaves the pivot
    const Face beyond = face->neighbor(out);
    if (!beyond->info().kept) return {face, out};
    face = beyond;
  }
}

/// Cuts a closed walk into vertex-simple loops: a vertex met again closes the loop since its first
/// visit. Linear, where the original's ring splitting was quadratic.
void split_loops(const std::vector<Vertex>& walk, std::vector<Ring2>& loops) {
  std::vector<Vertex> open;
  std::unordered_map<const void*, std::size_t> place;
  const auto emit = [&](std::size_t begin) {
    Ring2 ring;
    for (std::size_t i = begin; i < open.size(); ++i)
      ring.emplace_back(open[i]->point().x(), open[i]->point().y());
    if (ring.size() >= 3) loops.push_back(std::move(ring));
  };
  for (const Vertex v : walk) {
    if (const auto seen = place.find(&*v); seen != place.end()) {
      const std::size_t begin = seen->second;
      emit(begin);
      for (std::size_t i = begin; i < open.size(); ++i) place.erase(&*open[i]);
      open.resize(begin);
    }
    place[&*v] = open.size();
    open.push_back(v);
  }
  emit(0);
}

}  // namespace

std::vector<Polygon> alpha_shape(std::span<const Eigen::Vector2d> points, double alpha) {
  std::vector<Kernel::Point_2> sites;
  sites.reserve(points.size());
  for (const Eigen::Vector2d& p : points) sites.emplace_back(p.x(), p.y());
  const Delaunay triangulation(sites.begin(), sites.end());
  if (triangulation.dimension() < 2) return {};
  std::vector<Face> kept;
  for (const Face face : triangulation.finite_face_handles()) {
    if (has_long_side(face, alpha)) continue;
    face->info() = {true, kept.size(), {}};
    kept.push_back(face);
  }
  geometry::DisjointSets pieces(kept.size());  // joined by edges
  for (const Face face : kept)
    for (int i = 0; i < 3; ++i)
      if (const FaceMark& next = face->neighbor(i)->info(); next.kept)
        pieces.join(next.number, face->info().number);

  std::map<std::size_t, Polygon> outlines;
  for (const Face face : kept)
    for (int i = 0; i < 3; ++i) {
      if (face->neighbor(i)->info().kept || face->info().walked[static_cast<std::size_t>(i)]) continue;
      std::vector<Vertex> walk;
      BoundaryEdge edge{face, i};
      do {
        edge.face->info().walked[static_cast<std::size_t>(edge.index)] = true;
        walk.push_back(edge.from());
        edge = next_edge(edge);
      } while (edge.face != face || edge.index != i);
      std::vector<Ring2> loops;
      split_loops(walk, loops);
      Polygon& polygon = outlines[pieces.root(face->info().number)];
      for (Ring2& loop : loops) {
        if (geometry::signed_area(loop) > 0)
          polygon.outer = std::move(loop);
        else
          polygon.holes.push_back(std::move(loop));
      }
    }
  std::vector<Polygon> polygons;
  for (auto& [piece, polygon] : outlines)  // a sliver's area can round to nothing; it has no outer ring then
    if (!polygon.outer.empty()) polygons.push_back(std::move(polygon));
  geometry::order_rings(polygons);
  return polygons;
}

}  // namespace octosurf
