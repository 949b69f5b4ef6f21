#include "support/polygons.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_polygon.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>

namespace octosurf::test {
namespace {

namespace bg = boost::geometry;
using BgPoint = bg::model::d2::point_xy<double>;
using BgPolygon = bg::model::polygon<BgPoint, false, false>;  // counter-clockwise, open
using BgMultiPolygon = bg::model::multi_polygon<BgPolygon>;

BgPolygon to_boost(const Polygon& polygon) {
  BgPolygon out;
  for (const Eigen::Vector2d& p : polygon.outer) out.outer().emplace_back(p.x(), p.y());
  for (const Ring2& hole : polygon.holes) {
    out.inners().emplace_back();
    for (const Eigen::Vector2d& p : hole) out.inners().back().emplace_back(p.x(), p.y());
  }
  return out;
}

BgMultiPolygon to_boost(const std::vector<Polygon>& polygons) {
  BgMultiPolygon out;
  for (const Polygon& polygon : polygons) out.push_back(to_boost(polygon));
  return out;
}

}  // namespace

std::string invalid(const std::vector<Polygon>& polygons) {
  for (const Polygon& polygon : polygons) {
    std::string reason;
    if (!bg::is_valid(to_boost(polygon), reason)) return reason;
  }
  return {};
}

double area(const Polygon& polygon) { return bg::area(to_boost(polygon)); }

double area(const std::vector<Polygon>& polygons) {
  double sum = 0;
  for (const Polygon& polygon : polygons) sum += area(polygon);
  return sum;
}

double perimeter(const std::vector<Polygon>& polygons) {
  return static_cast<double>(bg::perimeter(to_boost(polygons)));
}

bool overlap(const Polygon& a, const Polygon& b) { return bg::overlaps(to_boost(a), to_boost(b)); }

double difference(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  BgMultiPolygon only;
  bg::sym_difference(to_boost(a), to_boost(b), only);
  return bg::area(only);
}

Common intersection(const std::vector<Polygon>& a, const std::vector<Polygon>& b) {
  BgMultiPolygon both;
  bg::intersection(to_boost(a), to_boost(b), both);
  if (both.empty()) return {};
  BgPoint middle;
  bg::centroid(both, middle);
  return {bg::area(both), {middle.x(), middle.y()}};
}

struct Region::Polygons {
  BgMultiPolygon shape;
};

Region::Region(const std::vector<Polygon>& polygons)
    : polygons_(std::make_shared<const Polygons>(Polygons{to_boost(polygons)})) {}

bool Region::covers(const Eigen::Vector2d& p) const {
  return bg::covered_by(BgPoint(p.x(), p.y()), polygons_->shape);
}

std::size_t count_vertices(const std::vector<Polygon>& polygons) {
  std::size_t vertices = 0;
  for (const Polygon& polygon : polygons) {
    vertices += polygon.outer.size();
    for (const Ring2& hole : polygon.holes) vertices += hole.size();
  }
  return vertices;
}

double distance_to_rings(const Eigen::Vector2d& p, const std::vector<Polygon>& polygons) {
  double nearest = 1e300;
  const auto look = [&](const Ring2& ring) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d a = ring[i], e = ring[(i + 1) % ring.size()] - a;
      const double t = e.squaredNorm() > 0 ? std::clamp((p - a).dot(e) / e.squaredNorm(), 0.0, 1.0) : 0.0;
      nearest = std::min(nearest, (p - a - t * e).norm());
    }
  };
  for (const Polygon& polygon : polygons) {
    look(polygon.outer);
    for (const Ring2& hole : polygon.holes) look(hole);
  }
  return nearest;
}

}  // namespace octosurf::test
