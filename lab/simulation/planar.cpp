#include "simulation/planar.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_point.hpp>
#include <boost/geometry/geometries/multi_polygon.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <cmath>
#include <optional>

namespace octosurf::simulation {
namespace {

namespace bg = boost::geometry;
using Point = bg::model::d2::point_xy<double>;
using Area = bg::model::polygon<Point, false, false>;  // counter-clockwise, open
using Areas = bg::model::multi_polygon<Area>;

/// A solid touches a face if it is met this far in front of it, m. Below any gap meant as one, above
/// what rounding makes of contact.
constexpr double contact_gap = 2e-5;
/// Coordinates are rounded to this, m, so that edges meant to be one are one to the bit.
constexpr double grid = 1e-8;
/// Areas and holes narrower than about this, m, are left-overs of `contact_gap`, no faces.
constexpr double sliver = 5e-4;

Point snapped(const Eigen::Vector3d& p) {
  return {std::round(p.x() / grid) * grid, std::round(p.y() / grid) * grid};
}

/// Where the solid meets the plane z = contact_gap of the face's frame.
std::optional<Area> section(const Solid& solid, const Eigen::Isometry3d& T_face_scene) {
  bg::model::multi_point<Point> points;
  for (const auto& facet : solid.facets)
    for (std::size_t i = 0; i < facet.ring.size(); ++i) {
      const Eigen::Vector3d a = T_face_scene * facet.ring[i];
      const Eigen::Vector3d b = T_face_scene * facet.ring[(i + 1) % facet.ring.size()];
      const double da = a.z() - contact_gap;
      const double db = b.z() - contact_gap;
      if ((da < 0) == (db < 0)) continue;
      points.push_back(snapped(a + (b - a) * (da / (da - db))));
    }
  if (points.size() < 3) return std::nullopt;
  Area hull;
  bg::convex_hull(points, hull);
  if (bg::area(hull) < sliver * sliver) return std::nullopt;
  return hull;
}

Ring2 to_ring(const bg::model::ring<Point, false, false>& points) {
  Ring2 ring;
  for (const auto& p : points) ring.emplace_back(p.x(), p.y());
  return ring;
}

bool is_sliver(const bg::model::ring<Point, false, false>& ring) {
  return std::abs(bg::area(ring)) < sliver * bg::perimeter(ring) / 2;
}

Areas without_slivers(const Areas& areas) {
  Areas kept;
  for (const auto& area : areas) {
    if (is_sliver(area.outer())) continue;
    Area clean;
    clean.outer() = area.outer();
    for (const auto& hole : area.inners())
      if (!is_sliver(hole)) clean.inners().push_back(hole);
    // Without width, where a solid's rim lies on the face's own: Boost 1.83 leaves them.
    bg::remove_spikes(clean);
    kept.push_back(std::move(clean));
  }
  return kept;
}

Areas union_of_facets(const PlanarGroup& group, const Eigen::Isometry3d& T_face_scene) {
  Areas areas;
  for (const auto* facet : group.facets) {
    Area area;
    for (const auto& vertex : facet->ring) area.outer().push_back(snapped(T_face_scene * vertex));
    Areas joined;
    bg::union_(areas, area, joined);
    areas = std::move(joined);
  }
  return areas;
}

}  // namespace

Eigen::Isometry3d face_frame(const Eigen::Vector3d& normal, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d across = std::abs(normal.z()) < 0.95 ? Eigen::Vector3d::UnitZ().cross(normal)
                                                             : Eigen::Vector3d::UnitY().cross(normal);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear().col(0) = across.normalized();
  T.linear().col(1) = normal.cross(across).normalized();
  T.linear().col(2) = normal;
  T.translation() = origin;
  return T;
}

std::vector<Polygon> open_area(const PlanarGroup& group, const std::vector<const Solid*>& covers) {
  const Eigen::Isometry3d T_face_scene = group.T_scene_face.inverse();
  Areas areas = union_of_facets(group, T_face_scene);
  for (const auto* solid : covers) {
    const auto covered = section(*solid, T_face_scene);
    if (!covered) continue;
    Areas rest;
    bg::difference(areas, *covered, rest);
    areas = std::move(rest);
  }
  std::vector<Polygon> polygons;
  for (const auto& area : without_slivers(areas)) {
    Polygon& polygon = polygons.emplace_back();
    polygon.outer = to_ring(area.outer());
    for (const auto& hole : area.inners()) polygon.holes.push_back(to_ring(hole));
  }
  return polygons;
}

}  // namespace octosurf::simulation
