#pragma once

#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_polygon.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <string>
#include <vector>

#include <octosurf/surface.hpp>

namespace octosurf::test {

namespace bg = boost::geometry;
using BgPoint = bg::model::d2::point_xy<double>;
using BgPolygon = bg::model::polygon<BgPoint, false, false>;  // counter-clockwise, open
using BgMultiPolygon = bg::model::multi_polygon<BgPolygon>;

inline BgPolygon to_boost(const Polygon& polygon) {
  BgPolygon out;
  for (const Eigen::Vector2d& p : polygon.outer) out.outer().emplace_back(p.x(), p.y());
  for (const Ring2& hole : polygon.holes) {
    out.inners().emplace_back();
    for (const Eigen::Vector2d& p : hole) out.inners().back().emplace_back(p.x(), p.y());
  }
  return out;
}
inline BgMultiPolygon to_boost(const std::vector<Polygon>& polygons) {
  BgMultiPolygon out;
  for (const Polygon& polygon : polygons) out.push_back(to_boost(polygon));
  return out;
}

/// Empty if every polygon is valid by the OGC rules (orientation included), else what is wrong.
inline std::string invalid(const std::vector<Polygon>& polygons) {
  for (const Polygon& polygon : polygons) {
    std::string reason;
    if (!bg::is_valid(to_boost(polygon), reason)) return reason;
  }
  return {};
}

/// Point in polygon or on its rings.
inline bool covered(const Eigen::Vector2d& p, const BgMultiPolygon& polygons) {
  return bg::covered_by(BgPoint(p.x(), p.y()), polygons);
}

inline std::size_t count_rings(const std::vector<Polygon>& polygons) {
  std::size_t rings = 0;
  for (const Polygon& polygon : polygons) rings += 1 + polygon.holes.size();
  return rings;
}

/// Distance from a point to the nearest ring.
inline double distance_to_rings(const Eigen::Vector2d& p, const std::vector<Polygon>& polygons) {
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
