#include "planning/blocked_polygon.hpp"

#include "planning/rings.hpp"

#include <boost/polygon/polygon.hpp>
#include <cmath>

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

template <typename Points>
Ring2 in_metres(const Points& points) {
  Ring2 ring;
  for (const IntegerPoint& p : points) ring.emplace_back(p.x() / per_metre, p.y() / per_metre);
  // Boost repeats the first vertex at the end.
  while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return ring;
}

/// What is left, with the holes of each part.
std::vector<Polygon> parts_of(const Set& left) {
  std::vector<bp::polygon_with_holes_data<int>> parts;
  left.get(parts);
  std::vector<Polygon> result;
  for (const auto& part : parts) {
    Polygon one{in_metres(part), {}};
    for (auto hole = part.begin_holes(); hole != part.end_holes(); ++hole)
      one.holes.push_back(in_metres(*hole));
    result.push_back(std::move(one));
  }
  return result;
}

/// The curve of a ring whose inside lies to its left: each edge moved by the vertex of the kernel that is
/// farthest to `side` of it (1: left), joined by the kernel's edges where the ring turns.
std::vector<IntegerPoint> convolved(const Ring2& ring, const Ring2& kernel, double side) {
  const std::size_t n = ring.size(), m = kernel.size();
  const auto off_by = [side](const Eigen::Vector2d& along) -> Eigen::Vector2d {
    return side * Eigen::Vector2d(-along.y(), along.x());
  };
  Eigen::Vector2d normal = off_by(ring[0] - ring[n - 1]);
  std::size_t at = 0;
  for (std::size_t k = 1; k < m; ++k)
    if (kernel[k].dot(normal) > kernel[at].dot(normal)) at = k;
  Ring2 curve;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d next = off_by(ring[(i + 1) % n] - ring[i]);
    const double turn = cross(normal, next);
    const std::size_t step = turn > 0 || (turn == 0 && normal.dot(next) < 0) ? 1 : m - 1;
    curve.push_back(ring[i] + kernel[at]);
    // The way the ring turns, so that rounding never leads around the kernel.
    for (std::size_t k = (at + step) % m; kernel[k].dot(next) > kernel[at].dot(next); k = (at + step) % m) {
      at = k;
      curve.push_back(ring[i] + kernel[at]);
    }
    normal = next;
  }
  return on_grid(curve);
}

void insert_convolved(const Ring2& ring, const Ring2& kernel, double side, Set& set) {
  const std::vector<IntegerPoint> curve = convolved(ring, kernel, side);
  set.insert_vertex_sequence(curve.begin(), curve.end(), bp::COUNTERCLOCKWISE, false);
}

Eigen::Vector2d extent(const Ring2& ring) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : ring) box.extend(p);
  return box.sizes();
}

}  // namespace

std::vector<Polygon> inset(const Polygon& polygon, const Ring2& kernel, std::span<const Ring2> blocked,
                           const KeptOff& off) {
  // A smaller polygon could lie all within the kernel, with its outside all around it: one part, not none.
  if (polygon.outer.size() < 3 || (extent(polygon.outer).array() < extent(kernel).array()).any()) return {};
  Set left, gone;
  insert_convolved(polygon.outer, kernel, 1, left);
  for (const Ring2& hole : polygon.holes) insert_convolved(hole, kernel, 1, left);
  for (const Ring2& ring : blocked) gone.insert(polygon_of(ring));
  for (const Polygon& obstacle : off.obstacles) {
    insert_convolved(obstacle.outer, off.kernel, -1, gone);
    // Likewise a hole within the kernel, which holds no place for it.
    for (const Ring2& hole : obstacle.holes)
      if ((extent(hole).array() >= extent(off.kernel).array()).any())
        insert_convolved(hole, off.kernel, -1, gone);
  }
  bp::operators::operator-=(left, gone);
  return parts_of(left);
}

std::vector<Polygon> remaining(const Polygon& polygon, std::span<const Ring2> blocked) {
  return reshaped({&polygon, 1}, {}, blocked);
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
