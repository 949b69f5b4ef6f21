#include "io/exporters/planner_pieces.hpp"

#include "geometry/rings.hpp"
#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

bool crosses(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& point) {
  if ((a.y() <= point.y()) == (b.y() <= point.y())) return false;
  return a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()) > point.x();
}

bool odd_crossings(const Ring2& ring, const Eigen::Vector2d& point) {
  bool odd = false;
  for (std::size_t i = 0; i < ring.size(); ++i) odd ^= crosses(ring[i], ring[(i + 1) % ring.size()], point);
  return odd;
}

}  // namespace

void require_pieces(const std::vector<PlannerSurface>& surfaces, const std::filesystem::path& file) {
  bool any = false;
  for (const PlannerSurface& surface : surfaces)
    for (const ConvexPiece& piece : surface.pieces) {
      any = true;
      for (const Eigen::Vector3d& vertex : piece.vertices) finite(vertex.sum(), surface.id);
      if (piece.vertices.size() < 3)
        throw Error(Error::Kind::data, "surface " + std::to_string(surface.id),
                    "has a piece of fewer than three vertices", "cut the region anew");
    }
  if (!any)
    throw Error(Error::Kind::data, file.string(), "there is nothing to put into it",
                "no surface has room for the contact; a smaller foot or a larger slope leaves more, "
                "and --up where z is not up");
}

Eigen::Vector2d interior_point(const Polygon& polygon) {
  std::vector<Eigen::Vector2d> vertices;
  const auto triangles = geometry::triangulate(polygon, vertices);
  if (triangles.empty())
    throw Error(Error::Kind::data, "polygon", "has no area", "build the map anew from its scans");
  const auto area = [&](const std::array<std::uint32_t, 3>& t) {
    return geometry::signed_area({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  };
  const auto& t = *std::max_element(triangles.begin(), triangles.end(),
                                    [&](const auto& a, const auto& b) { return area(a) < area(b); });
  return (vertices[t[0]] + vertices[t[1]] + vertices[t[2]]) / 3;
}

std::size_t polygon_with(const std::vector<Polygon>& polygons, const Eigen::Vector2d& point) {
  const auto found = std::find_if(polygons.begin(), polygons.end(), [&](const Polygon& polygon) {
    bool inside = odd_crossings(polygon.outer, point);
    for (const Ring2& hole : polygon.holes) inside ^= odd_crossings(hole, point);
    return inside;
  });
  return static_cast<std::size_t>(found - polygons.begin());
}

}  // namespace octosurf::io
