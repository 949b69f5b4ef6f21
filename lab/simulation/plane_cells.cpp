#include "simulation/plane_cells.hpp"

#include <CGAL/Arr_extended_dcel.h>
#include <CGAL/Arr_segment_traits_2.h>
#include <CGAL/Arrangement_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_triangulation_decomposition_2.h>
#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <set>

namespace octosurf::simulation {
namespace {

namespace bg = boost::geometry;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Traits = CGAL::Arr_segment_traits_2<Kernel>;
enum class Cell { outside, inside };
using Arrangement = CGAL::Arrangement_2<Traits, CGAL::Arr_face_extended_dcel<Traits, Cell>>;
using Decomposition = CGAL::Polygon_triangulation_decomposition_2<Kernel>;

constexpr std::size_t samples_per_cell = 3;

/// End points, those within a tolerance of each other as one.
class Points {
 public:
  explicit Points(double tolerance) : tolerance_(tolerance) {}

  std::size_t index(const Eigen::Vector2d& p) {
    for (const std::size_t i : in_box(p, p))
      if ((points_[i] - p).norm() <= tolerance_) return i;
    points_.push_back(p);
    tree_.insert({{p.x(), p.y()}, points_.size() - 1});
    return points_.size() - 1;
  }

  const Eigen::Vector2d& operator[](std::size_t i) const { return points_[i]; }

  /// Points within the tolerance of the segment from a to b, in order, both ends included.
  std::vector<std::size_t> along(std::size_t a, std::size_t b) const {
    const Eigen::Vector2d& p = points_[a];
    const double length = (points_[b] - p).norm();
    const Eigen::Vector2d forward = (points_[b] - p) / length;
    std::vector<std::pair<double, std::size_t>> met;
    for (const std::size_t i : in_box(p.cwiseMin(points_[b]), p.cwiseMax(points_[b]))) {
      const Eigen::Vector2d v = points_[i] - p;
      const double s = v.dot(forward);
      const double off = forward.x() * v.y() - forward.y() * v.x();
      if (i == a || i == b || (s > 0 && s < length && std::abs(off) <= tolerance_)) met.emplace_back(s, i);
    }
    std::sort(met.begin(), met.end());
    std::vector<std::size_t> order;
    for (const auto& [s, i] : met) order.push_back(i);
    return order;
  }

 private:
  using Point = bg::model::d2::point_xy<double>;

  std::vector<std::size_t> in_box(const Eigen::Vector2d& min, const Eigen::Vector2d& max) const {
    const bg::model::box<Point> box({min.x() - tolerance_, min.y() - tolerance_},
                                    {max.x() + tolerance_, max.y() + tolerance_});
    std::vector<std::size_t> found;
    for (auto it = tree_.qbegin(bg::index::intersects(box)); it != tree_.qend(); ++it)
      found.push_back(it->second);
    std::sort(found.begin(), found.end());  // the tree's order is its own business
    return found;
  }

  double tolerance_;
  std::vector<Eigen::Vector2d> points_;
  bg::index::rtree<std::pair<Point, std::size_t>, bg::index::quadratic<16>> tree_;
};

Arrangement arrange(const std::vector<Segment2>& segments, double tolerance) {
  Points points(tolerance);
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  for (const auto& [a, b] : segments) {
    const std::size_t i = points.index(a);
    const std::size_t j = points.index(b);
    if (i != j) ends.emplace_back(std::minmax(i, j));
  }
  std::set<std::pair<std::size_t, std::size_t>> pieces;
  for (const auto& [i, j] : ends) {
    const auto stops = points.along(i, j);
    for (std::size_t k = 1; k < stops.size(); ++k) pieces.insert(std::minmax(stops[k - 1], stops[k]));
  }
  std::vector<Traits::X_monotone_curve_2> curves;
  for (const auto& [i, j] : pieces)
    curves.emplace_back(Kernel::Point_2(points[i].x(), points[i].y()),
                        Kernel::Point_2(points[j].x(), points[j].y()));
  Arrangement arrangement;
  CGAL::insert(arrangement, curves.begin(), curves.end());
  return arrangement;
}

/// Removes the edges whose two sides `same` takes for one.
template <class Same>
void remove_edges(Arrangement& arrangement, Same&& same) {
  std::vector<Arrangement::Halfedge_handle> edges;
  for (auto edge = arrangement.edges_begin(); edge != arrangement.edges_end(); ++edge)
    edges.emplace_back(edge);
  for (const auto& edge : edges) {
    if (!same(edge->face(), edge->twin()->face())) continue;
    const Cell cell = edge->face()->data();
    arrangement.remove_edge(edge)->set_data(cell);
  }
}

Decomposition::Polygon_2 exact_ring(Arrangement::Ccb_halfedge_const_circulator first) {
  Decomposition::Polygon_2 ring;
  auto edge = first;
  do ring.push_back(edge->target()->point());
  while (++edge != first);
  return ring;
}

/// Points well inside the cell.
std::vector<Eigen::Vector2d> samples(Arrangement::Face_const_handle face) {
  Decomposition::Polygon_with_holes_2 polygon(exact_ring(face->outer_ccb()));
  for (auto hole = face->inner_ccbs_begin(); hole != face->inner_ccbs_end(); ++hole)
    polygon.add_hole(exact_ring(*hole));
  std::vector<Decomposition::Polygon_2> triangles;
  Decomposition()(polygon, std::back_inserter(triangles));
  std::vector<std::pair<double, Eigen::Vector2d>> middles;
  for (const auto& triangle : triangles) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const auto& p : triangle) sum += Eigen::Vector2d(CGAL::to_double(p.x()), CGAL::to_double(p.y()));
    middles.emplace_back(-std::abs(CGAL::to_double(triangle.area())),
                         sum / static_cast<double>(triangle.size()));
  }
  std::stable_sort(middles.begin(), middles.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < std::min(samples_per_cell, middles.size()); ++i)
    points.push_back(middles[i].second);
  return points;
}

/// Without vertices on the straight line between their neighbours.
Ring2 plain_ring(Arrangement::Ccb_halfedge_const_circulator first) {
  Ring2 ring;
  auto edge = first;
  do {
    auto next = edge;
    ++next;
    if (CGAL::collinear(edge->source()->point(), edge->target()->point(), next->target()->point())) continue;
    const auto& p = edge->target()->point();
    ring.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()));
  } while (++edge != first);
  return ring;
}

bool is_sliver(const Ring2& ring, double width) {
  double twice_area = 0;
  double perimeter = 0;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    twice_area += ring[j].x() * ring[i].y() - ring[i].x() * ring[j].y();
    perimeter += (ring[i] - ring[j]).norm();
  }
  return std::abs(twice_area) < width * perimeter;
}

}  // namespace

std::vector<Polygon> cells_where(const std::vector<Segment2>& segments, double tolerance,
                                 const std::function<bool(const Eigen::Vector2d&)>& inside) {
  Arrangement arrangement = arrange(segments, tolerance);
  remove_edges(arrangement, [](auto a, auto b) { return a == b; });  // those that end within a cell
  for (auto face = arrangement.faces_begin(); face != arrangement.faces_end(); ++face) {
    face->set_data(Cell::outside);
    if (face->is_unbounded()) continue;
    const auto points = samples(face);
    if (std::any_of(points.begin(), points.end(), inside)) face->set_data(Cell::inside);
  }
  remove_edges(arrangement, [](auto a, auto b) { return a->data() == b->data(); });

  std::vector<Polygon> polygons;
  for (auto face = arrangement.faces_begin(); face != arrangement.faces_end(); ++face) {
    if (face->data() != Cell::inside) continue;
    Polygon polygon{plain_ring(face->outer_ccb()), {}};
    if (is_sliver(polygon.outer, 2 * tolerance)) continue;
    for (auto hole = face->inner_ccbs_begin(); hole != face->inner_ccbs_end(); ++hole)
      if (Ring2 ring = plain_ring(*hole); !is_sliver(ring, 2 * tolerance))
        polygon.holes.push_back(std::move(ring));
    polygons.push_back(std::move(polygon));
  }
  return polygons;
}

}  // namespace octosurf::simulation
