#include "geometry/simplify.hpp"

#include "geometry/ring_check.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_plus_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polyline_simplification_2/Squared_distance_cost.h>
#include <CGAL/Polyline_simplification_2/simplify.h>
#include <cmath>

namespace octosurf {
namespace {

namespace ps = CGAL::Polyline_simplification_2;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SimplifiedVertex = ps::Vertex_base_2<Kernel>;
using SimplifiedFace = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<SimplifiedVertex, SimplifiedFace>;
using Triangulation = CGAL::Constrained_triangulation_plus_2<
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure, CGAL::No_constraint_intersection_tag>>;
using Constraint = Triangulation::Constraint_id;

/// As CGAL's, but without ties, which it breaks by addresses: on a raster's outlines many corners cost the
/// same.
struct Cost {
  template <class Base>
  auto operator()(
      const CGAL::Constrained_triangulation_plus_2<Base>& triangulation,
      typename CGAL::Constrained_triangulation_plus_2<Base>::Vertices_in_constraint_iterator at) const {
    auto cost = ps::Squared_distance_cost()(triangulation, at);
    constexpr double least = 1e-16;  // m²
    if (cost) *cost += least * std::fabs(std::sin(1e5 * (*at)->point().x() + 1.7e5 * (*at)->point().y()));
    return cost;
  }
};

Constraint insert_ring(Triangulation& triangulation, const Ring2& ring) {
  std::vector<Kernel::Point_2> points;
  for (const Eigen::Vector2d& p : ring) points.emplace_back(p.x(), p.y());
  points.push_back(points.front());
  return triangulation.insert_constraint(points.begin(), points.end());
}

Ring2 read_ring(const Triangulation& triangulation, Constraint constraint) {
  Ring2 ring;
  for (auto v = triangulation.vertices_in_constraint_begin(constraint);
       v != triangulation.vertices_in_constraint_end(constraint); ++v)
    ring.emplace_back((*v)->point().x(), (*v)->point().y());
  ring.pop_back();  // the constraint is closed by a copy of its first vertex
  return ring;
}

}  // namespace

std::vector<Polygon> geometry::simplify(const std::vector<Polygon>& polygons, double tolerance) {
  Triangulation triangulation;
  std::vector<std::vector<Constraint>> rings;
  for (const Polygon& polygon : polygons) {
    auto& ids = rings.emplace_back();
    ids.push_back(insert_ring(triangulation, polygon.outer));
    for (const Ring2& hole : polygon.holes) ids.push_back(insert_ring(triangulation, hole));
  }
  ps::simplify(triangulation, Cost(), ps::Stop_above_cost_threshold(tolerance * tolerance));
  std::vector<Polygon> result;
  for (const auto& ids : rings) {
    Polygon& polygon = result.emplace_back();
    polygon.outer = read_ring(triangulation, ids.front());
    for (std::size_t i = 1; i < ids.size(); ++i)
      if (Ring2 hole = read_ring(triangulation, ids[i]); hole.size() >= 3)
        polygon.holes.push_back(std::move(hole));
    if (polygon.outer.size() < 3) result.pop_back();
  }
  return result;
}

std::vector<Polygon> simplified(const Surface& surface) {
  geometry::require_polygons(surface.polygons, "surface " + std::to_string(surface.id));
  if (surface.resolution <= 0) return surface.polygons;
  return geometry::simplify(surface.polygons, surface.resolution / 2);
}

}  // namespace octosurf
