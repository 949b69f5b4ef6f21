#include "geometry/triangulate.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <deque>
#include <limits>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::geometry {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
constexpr int unmarked = -1;

struct VertexInfo {
  std::uint32_t index = unused;
};
struct FaceInfo {
  int level = unmarked;  // ring edges between this face and the outside
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<VertexInfo, Kernel>;
using FaceBase =
    CGAL::Constrained_triangulation_face_base_2<Kernel,
                                                CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>;
// Exact_predicates_tag: crossing rings are split at a rounded point instead of being rejected.
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>, CGAL::Exact_predicates_tag>;

void add_ring(const Ring2& ring, std::vector<Kernel::Point_2>& points,
              std::vector<std::pair<std::size_t, std::size_t>>& edges) {
  const std::size_t first = points.size();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    if (!ring[i].allFinite()) throw Error(Error::Kind::data, "polygon", "a vertex is not finite");
    points.emplace_back(ring[i].x(), ring[i].y());
    edges.emplace_back(first + i, first + (i + 1) % ring.size());
  }
}

// Flood from the infinite face by levels: faces not separated by a ring edge share a level; a face is inside
// if an odd number of ring edges was crossed.
void mark_levels(const Cdt& cdt) {
  std::deque<std::pair<Cdt::Face_handle, int>> queue{{cdt.infinite_face(), 0}};
  while (!queue.empty()) {
    const auto [face, level] = queue.front();
    queue.pop_front();
    if (face->info().level != unmarked) continue;
    face->info().level = level;
    for (int i = 0; i < 3; ++i) {
      if (face->is_constrained(i)) {
        queue.emplace_back(face->neighbor(i), level + 1);
      } else {
        queue.emplace_front(face->neighbor(i), level);
      }
    }
  }
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate(const Polygon& polygon,
                                                      std::vector<Eigen::Vector2d>& vertices) {
  vertices.clear();
  std::vector<Kernel::Point_2> points;
  std::vector<std::pair<std::size_t, std::size_t>> edges;
  add_ring(polygon.outer, points, edges);
  for (const Ring2& hole : polygon.holes) add_ring(hole, points, edges);

  Cdt cdt;
  cdt.insert_constraints(points.begin(), points.end(), edges.begin(), edges.end());
  std::vector<std::array<std::uint32_t, 3>> triangles;
  if (cdt.dimension() < 2) return triangles;
  mark_levels(cdt);

  for (const Cdt::Face_handle face : cdt.finite_face_handles()) {
    if (face->info().level % 2 == 0) continue;
    std::array<std::uint32_t, 3> triangle{};
    for (int i = 0; i < 3; ++i) {
      const Cdt::Vertex_handle vertex = face->vertex(i);
      if (vertex->info().index == unused) {
        vertex->info().index = static_cast<std::uint32_t>(vertices.size());
        vertices.emplace_back(vertex->point().x(), vertex->point().y());
      }
      triangle[static_cast<std::size_t>(i)] = vertex->info().index;
    }
    triangles.push_back(triangle);
  }
  return triangles;
}

}  // namespace octosurf::geometry
