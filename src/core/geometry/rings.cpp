#include "geometry/rings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

namespace octosurf::geometry {
namespace {

bool ring_before(const Ring2& a, const Ring2& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), is_before);
}
void start_at_smallest(Ring2& ring) {
  std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end(), is_before), ring.end());
}

/// Whether strictly inside; empty for a vertex. Exact where products of the coordinates' differences are.
std::optional<bool> inside(const Eigen::Vector2d& p, const Ring2& ring) {
  bool in = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
    if (a == p) return {};
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    const double side = (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
    if ((side > 0) == (b.y() > a.y())) in = !in;
  }
  return in;
}

bool lies_in(const Ring2& hole, const Ring2& outer) {
  for (const Eigen::Vector2d& p : hole)
    if (const std::optional<bool> in = inside(p, outer)) return *in;
  return false;
}

struct Outer {
  double area;
  Eigen::AlignedBox2d box;
  Polygon polygon;
};

Eigen::AlignedBox2d box_of(const Ring2& ring) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : ring) box.extend(p);
  return box;
}

}  // namespace

void order_rings(std::vector<Polygon>& polygons) {
  for (Polygon& polygon : polygons) {
    start_at_smallest(polygon.outer);
    for (Ring2& hole : polygon.holes) start_at_smallest(hole);
    std::sort(polygon.holes.begin(), polygon.holes.end(), ring_before);
  }
  std::sort(polygons.begin(), polygons.end(),
            [](const Polygon& a, const Polygon& b) { return ring_before(a.outer, b.outer); });
}

std::vector<Polygon> polygons_of(std::vector<Ring2> rings) {
  std::vector<Outer> outers;
  std::vector<Ring2> holes;
  for (Ring2& ring : rings) {
    if (const double area = signed_area(ring); area > 0)
      outers.push_back({area, box_of(ring), {std::move(ring), {}}});
    else
      holes.push_back(std::move(ring));
  }
  // The smallest outer ring about a hole is its own: larger ones surround the hole of an island.
  std::sort(outers.begin(), outers.end(), [](const Outer& a, const Outer& b) { return a.area < b.area; });
  std::vector<Outer*> about;
  for (Ring2& hole : holes) {
    const Eigen::AlignedBox2d box = box_of(hole);
    about.clear();
    for (Outer& outer : outers)
      if (outer.box.contains(box)) about.push_back(&outer);
    const auto own =
        about.size() < 2 ? about.begin() : std::find_if(about.begin(), about.end(), [&](const Outer* outer) {
          return lies_in(hole, outer->polygon.outer);
        });
    if (own != about.end()) (*own)->polygon.holes.push_back(std::move(hole));
  }
  std::vector<Polygon> polygons;
  polygons.reserve(outers.size());
  for (Outer& outer : outers) polygons.push_back(std::move(outer.polygon));
  order_rings(polygons);
  return polygons;
}

double signed_area(const Ring2& ring) {
  double twice = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    // Relative to the first vertex, so that distant rings keep full precision.
    const Eigen::Vector2d a = ring[i] - ring[0], b = ring[(i + 1) % ring.size()] - ring[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

void set_polygons(Surface& surface, std::vector<Polygon> polygons) {
  surface.polygons = std::move(polygons);
  surface.boundary.clear();
  surface.area_m2 = 0;
  for (const Polygon& polygon : surface.polygons) {
    for (const Eigen::Vector2d& p : polygon.outer) surface.boundary.push_back(surface.to_map(p));
    for (const Ring2& hole : polygon.holes)
      for (const Eigen::Vector2d& p : hole) surface.boundary.push_back(surface.to_map(p));
    surface.area_m2 += area_of(polygon);
  }
}

double area_of(const Polygon& polygon) {
  double area = signed_area(polygon.outer);
  for (const Ring2& hole : polygon.holes) area += signed_area(hole);
  return area;
}

}  // namespace octosurf::geometry
