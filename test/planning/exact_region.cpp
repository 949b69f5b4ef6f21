#include "planning/exact_region.hpp"

#include <CGAL/Boolean_set_operations_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_set_2.h>
#include <CGAL/convex_hull_2.h>
#include <list>

namespace octosurf::test {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Exact = CGAL::Polygon_2<Kernel>;
using ExactSet = CGAL::Polygon_set_2<Kernel>;
using ExactWithHoles = CGAL::Polygon_with_holes_2<Kernel>;

Exact ring_of(const Ring2& ring) {
  Exact result;
  for (const Eigen::Vector2d& p : ring) result.push_back({p.x(), p.y()});
  if (result.orientation() == CGAL::CLOCKWISE) result.reverse_orientation();
  return result;
}

/// {p − q: p of a, q of b}, of convex ones.
Exact difference_of(const Ring2& a, const Ring2& b) {
  std::vector<Kernel::Point_2> points, hull;
  for (const Eigen::Vector2d& p : a)
    for (const Eigen::Vector2d& q : b)
      points.push_back(Kernel::Point_2(p.x(), p.y()) - Kernel::Vector_2(q.x(), q.y()));
  CGAL::convex_hull_2(points.begin(), points.end(), std::back_inserter(hull));
  return {hull.begin(), hull.end()};
}

ExactSet set_of(const std::vector<Polygon>& polygons) {
  ExactSet set;
  for (const Polygon& polygon : polygons) {
    ExactSet one(ring_of(polygon.outer));
    for (const Ring2& hole : polygon.holes) one.difference(ring_of(hole));
    set.join(one);
  }
  return set;
}

double area_of(const ExactSet& set) {
  std::list<ExactWithHoles> parts;
  set.polygons_with_holes(std::back_inserter(parts));
  Kernel::FT sum = 0;
  for (const ExactWithHoles& part : parts) {
    sum += part.outer_boundary().area();
    for (auto hole = part.holes_begin(); hole != part.holes_end(); ++hole) sum += hole->area();
  }
  return CGAL::to_double(sum);
}

}  // namespace

struct ExactRegion::Set {
  ExactSet set;
};

ExactRegion::ExactRegion(const std::vector<Polygon>& polygons, const Ring2& contact) {
  // Of each polygon alone: a contact cannot pass through the points where two touch.
  ExactSet all;
  for (const Polygon& polygon : polygons) {
    // The reference point may lie off the contact: where any point of the contact is on the polygon.
    ExactSet one;
    ExactWithHoles moved(ring_of([&] {
      Ring2 ring = polygon.outer;
      for (Eigen::Vector2d& p : ring) p -= contact.front();
      return ring;
    }()));
    one.join(moved);
    for (Ring2 hole : polygon.holes) {
      for (Eigen::Vector2d& p : hole) p -= contact.front();
      one.difference(ring_of(hole));
    }
    const auto cut = [&](const Ring2& ring) {
      for (std::size_t i = 0; i < ring.size(); ++i)
        one.difference(difference_of({ring[i], ring[(i + 1) % ring.size()]}, contact));
    };
    cut(polygon.outer);
    for (const Ring2& hole : polygon.holes) cut(hole);
    all.join(one);
  }
  set_ = std::make_shared<const Set>(Set{std::move(all)});
}

double ExactRegion::area() const { return area_of(set_->set); }

bool ExactRegion::covers(const std::vector<Polygon>& polygons) const {
  ExactSet beyond = set_of(polygons);
  beyond.difference(set_->set);
  return beyond.is_empty();
}

double exact_difference(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  ExactSet either = set_of(a);
  either.symmetric_difference(set_of(b));
  return area_of(either);
}

bool disjoint(const std::vector<Ring2>& rings) {
  for (std::size_t i = 0; i < rings.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (CGAL::do_intersect(ring_of(rings[i]), ring_of(rings[j]))) return false;
  return true;
}

bool inside_of(const std::vector<Ring2>& rings, const std::vector<Polygon>& polygons) {
  const ExactSet all = set_of(polygons);
  for (const Ring2& ring : rings) {
    ExactSet beyond(ring_of(ring));
    beyond.difference(all);
    if (!beyond.is_empty()) return false;
  }
  return true;
}

}  // namespace octosurf::test
