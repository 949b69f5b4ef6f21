#include "planning/blocked_polygon.hpp"

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

}  // namespace

std::vector<Polygon> remaining(const Polygon& polygon, std::span<const Ring2> blocked) {
  Set left, gone;
  left.insert(polygon_of(polygon.outer));
  for (const Ring2& hole : polygon.holes) gone.insert(polygon_of(hole));
  for (const Ring2& ring : blocked) gone.insert(polygon_of(ring));
  bp::operators::operator-=(left, gone);
  return parts_of(left);
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
