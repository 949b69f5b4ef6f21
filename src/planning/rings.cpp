#include "planning/rings.hpp"

#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"

#include <algorithm>
#include <boost/polygon/polygon.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf::planning {
namespace {

namespace bp = boost::polygon;
using IntegerPoint = bp::point_data<int>;
using Set = bp::polygon_set_data<int>;

constexpr double per_metre = 1e6;
constexpr double largest = 2e9;  // maximum coordinate of the grid, which has 31 bits

std::vector<IntegerPoint> on_grid(const Ring2& ring) {
  std::vector<IntegerPoint> points;
  points.reserve(ring.size());
  for (const Eigen::Vector2d& p : ring) {
    const Eigen::Vector2d scaled = p * per_metre;
    if (!(scaled.cwiseAbs().maxCoeff() < largest))
      throw Error(Error::Kind::usage, "contact region", "a coordinate is 2 km or more, or not finite");
    points.emplace_back(static_cast<int>(std::lround(scaled.x())), static_cast<int>(std::lround(scaled.y())));
  }
  return points;
}

bp::polygon_data<int> polygon_of(const Ring2& ring) {
  const std::vector<IntegerPoint> points = on_grid(ring);
  return {points.begin(), points.end()};
}

/// Rings that come to no vertex twice: Boost's do where parts touch, and repeat the first vertex at the end.
template <typename Points>
void add_simple_rings(const Points& points, std::vector<Ring2>& outer, std::vector<Ring2>& holes) {
  std::vector<std::pair<int, int>> way;
  std::map<std::pair<int, int>, std::size_t> at;  // in `way`
  const auto close = [&](std::size_t first) {
    Ring2 ring;
    for (std::size_t k = first; k < way.size(); ++k) {
      ring.emplace_back(way[k].first / per_metre, way[k].second / per_metre);
      at.erase(way[k]);
    }
    way.resize(first);
    if (ring.size() < 3) return;
    const double area = geometry::signed_area(ring);
    if (area != 0) (area > 0 ? outer : holes).push_back(std::move(ring));
  };
  for (const IntegerPoint& p : points) {
    const std::pair<int, int> vertex(p.x(), p.y());
    if (const auto before = at.find(vertex); before != at.end()) close(before->second);
    at[vertex] = way.size();
    way.push_back(vertex);
  }
  close(0);
}

/// What is left, with the holes of each part.
std::vector<Polygon> parts_of(const Set& left) {
  std::vector<bp::polygon_with_holes_data<int>> parts;
  left.get(parts);
  std::vector<Polygon> result;
  for (const auto& part : parts) {
    std::vector<Ring2> outer, holes;
    add_simple_rings(part, outer, holes);
    for (auto hole = part.begin_holes(); hole != part.end_holes(); ++hole)
      add_simple_rings(*hole, outer, holes);
    const std::size_t first = result.size();
    for (Ring2& ring : outer) result.push_back({std::move(ring), {}});
    for (Ring2& hole : holes) {
      // At most one holds the middle of an edge: rings touch at vertices alone.
      const Eigen::Vector2d middle = (hole[0] + hole[1]) / 2;
      for (std::size_t k = result.size(); k-- > first;)  // islands in holes first
        if (result.size() == first + 1 || geometry::inside(result[k].outer, middle)) {
          result[k].holes.push_back(std::move(hole));
          break;
        }
    }
  }
  return result;
}

void divide(Ring2& ring, double longest_edge) {
  Ring2 divided;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d a = ring[i], along = ring[(i + 1) % ring.size()] - a;
    const int steps = std::max(1, static_cast<int>(std::ceil(along.norm() / longest_edge - 1e-9)));
    for (int k = 0; k < steps; ++k) divided.push_back(a + along * k / steps);
  }
  ring = std::move(divided);
}

}  // namespace

bool contains(const Polygon& polygon, const Eigen::Vector2d& point) {
  bool odd = geometry::inside(polygon.outer, point);
  for (const Ring2& hole : polygon.holes) odd ^= geometry::inside(hole, point);
  return odd;
}

Eigen::Vector2d closest_on_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                                   const Eigen::Vector2d& point) {
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  if (length2 <= 0) return from;
  return from + std::clamp(along.dot(point - from) / length2, 0.0, 1.0) * along;
}

std::vector<Polygon> clipped(const std::vector<Polygon>& polygons, const Eigen::AlignedBox2d& box) {
  std::vector<Polygon> parts = polygons;
  const auto is_gone = [](const Ring2& ring) { return ring.size() < 3; };
  for_each_ring(parts, [&](Ring2& ring) {
    for (const Eigen::Index axis : {0, 1}) {
      ring = cut(ring, [&](const Eigen::Vector2d& p) { return p[axis] - box.max()[axis]; });
      ring = cut(ring, [&](const Eigen::Vector2d& p) { return box.min()[axis] - p[axis]; });
    }
  });
  std::erase_if(parts, [&](const Polygon& part) { return is_gone(part.outer); });
  for (Polygon& part : parts) std::erase_if(part.holes, is_gone);
  return parts;
}

double depth_in(const Ring2& convex, const Eigen::Vector2d& point) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Eigen::Vector2d from = convex[i], along = convex[(i + 1) % convex.size()] - from;
    if (along.squaredNorm() > 0) least = std::min(least, cross(along, point - from) / along.norm());
  }
  return std::isfinite(least) ? least : -(point - convex[0]).norm();
}

double area_of(const std::vector<Polygon>& polygons) {
  double sum = 0;
  for (const Polygon& polygon : polygons) sum += geometry::area_of(polygon);
  return sum;
}

Eigen::AlignedBox2d box_of(const Surface& surface) {
  Eigen::AlignedBox2d box;
  for (const Polygon& polygon : surface.polygons) box.extend(box_of(polygon.outer));
  return box;
}

Eigen::AlignedBox3d box_of(const Surface& surface, const Eigen::Isometry3d& T) {
  Eigen::AlignedBox3d box;
  for (const Polygon& polygon : surface.polygons)
    for (const Eigen::Vector2d& p : polygon.outer) box.extend(T * Eigen::Vector3d(p.x(), p.y(), 0));
  return box;
}

bool same_outline(const Surface& a, const Surface& b) {
  const auto same = [](const Polygon& one, const Polygon& other) {
    return one.outer == other.outer && one.holes == other.holes;
  };
  return &a == &b || (a.T_map_surface.matrix() == b.T_map_surface.matrix() &&
                      std::ranges::equal(a.polygons, b.polygons, same));
}

SurfacePtr with_outline(const Surface& surface, std::vector<Polygon> polygons) {
  double longest_edge = 0;
  for_each_edge(surface.polygons, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    longest_edge = std::max(longest_edge, (b - a).norm());
  });
  auto result = std::make_shared<Surface>(surface);
  for_each_ring(polygons, [&](Ring2& ring) { divide(ring, longest_edge); });
  geometry::set_polygons(*result, std::move(polygons));
  return result;
}

std::vector<Polygon> reshaped(std::span<const Polygon> polygons, std::span<const Ring2> added,
                              std::span<const Ring2> removed) {
  Set left, gone;
  for (const Polygon& polygon : polygons) {
    left.insert(polygon_of(polygon.outer));
    // As a hole it takes away from its own polygon, and not from an island within it.
    for (const Ring2& hole : polygon.holes) left.insert(polygon_of(hole), true);
  }
  for (const Ring2& ring : added) left.insert(polygon_of(ring));
  for (const Ring2& ring : removed) gone.insert(polygon_of(ring));
  bp::operators::operator-=(left, gone);
  return parts_of(left);
}

}  // namespace octosurf::planning
