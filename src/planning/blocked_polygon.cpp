#include "planning/blocked_polygon.hpp"

#include "geometry/even_odd.hpp"
#include "geometry/rings.hpp"

#include <boost/polygon/polygon.hpp>
#include <cmath>
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

}  // namespace

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
