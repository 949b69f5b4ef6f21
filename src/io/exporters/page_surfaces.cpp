#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/exporters/page_parts.hpp"
#include "io/exporters/stairs_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include <octosurf/up.hpp>

namespace octosurf::io {
namespace {

using Json = PageBlock::Json;

constexpr std::uint8_t no_label = 255;
constexpr double polygon_step_m = 1e-4;  // polygons' coordinates are stored as multiples of it
constexpr double deg_per_rad = 180 / std::numbers::pi;

/// The polygons of all surfaces, ring after ring.
struct Rings {
  std::vector<std::int32_t> u, v;
  std::vector<std::uint8_t> edges;       ///< the kind of the edge from each vertex to the next
  std::vector<std::uint32_t> triangles;  ///< three vertices each, counted from the surface's first
};

void add_ring(Rings& rings, const Ring2& ring, SurfaceId id, const std::vector<EdgeKind>* kinds) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    rings.u.push_back(page_polygon_steps(ring[k].x(), id));
    rings.v.push_back(page_polygon_steps(ring[k].y(), id));
    rings.edges.push_back(kinds == nullptr ? no_label : static_cast<std::uint8_t>((*kinds)[k]));
  }
}

/// By the polygon's own vertices, numbered ring after ring from `first`. Triangles with other vertices, which
/// exist where rings cross against Polygon's contract, are skipped.
void add_triangles(Rings& rings, const Polygon& polygon, std::uint32_t first) {
  std::map<std::pair<double, double>, std::uint32_t> numbers;
  std::uint32_t number = first;
  const auto count = [&](const Ring2& ring) {
    for (const Eigen::Vector2d& uv : ring) numbers.emplace(std::pair(uv.x(), uv.y()), number++);
  };
  count(polygon.outer);
  for (const Ring2& hole : polygon.holes) count(hole);
  std::vector<Eigen::Vector2d> vertices;
  for (const std::array<std::uint32_t, 3>& triangle : geometry::triangulate(polygon, vertices)) {
    std::array<std::uint32_t, 3> mapped{};
    bool known = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d& uv = vertices[triangle[k]];
      const auto found = numbers.find({uv.x(), uv.y()});
      known = known && found != numbers.end();
      if (known) mapped[k] = found->second;
    }
    if (known) rings.triangles.insert(rings.triangles.end(), mapped.begin(), mapped.end());
  }
}

/// Adds the rings, and returns their numbers of vertices: [[outer, hole, …], …].
Json polygons_json(Rings& rings, const Surface& surface, const std::vector<PolygonEdges>* labels) {
  if (labels != nullptr) require_labels_of(surface, *labels);
  Json sizes = Json::array();
  std::uint32_t first = 0;
  for (std::size_t p = 0; p < surface.polygons.size(); ++p) {
    const Polygon& polygon = surface.polygons[p];
    const std::size_t before = rings.u.size();
    add_ring(rings, polygon.outer, surface.id, labels == nullptr ? nullptr : &(*labels)[p].outer);
    Json size = Json::array({polygon.outer.size()});
    for (std::size_t h = 0; h < polygon.holes.size(); ++h) {
      add_ring(rings, polygon.holes[h], surface.id, labels == nullptr ? nullptr : &(*labels)[p].holes[h]);
      size.push_back(polygon.holes[h].size());
    }
    add_triangles(rings, polygon, first);
    first += static_cast<std::uint32_t>(rings.u.size() - before);
    sizes.push_back(std::move(size));
  }
  return sizes;
}

template <typename Matrix>
Json numbers_json(const Matrix& matrix, const std::string& what) {
  Json list = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      list.push_back(finite(matrix(row, column), what));
  return list;
}

Json surface_json(Rings& rings, const Surface& surface, const std::vector<PolygonEdges>* labels) {
  const std::string name = "surface " + std::to_string(surface.id);
  Json color = Json::array();
  for (const float c : surface.color) color.push_back(std::round(finite(c, name) * 1e4) / 1e4);
  const std::size_t triangles_before = rings.triangles.size();
  Json json;
  json["id"] = surface.id;
  json["color"] = std::move(color);
  json["normal"] = numbers_json(surface.plane.normal, name);
  json["offset"] = finite(surface.plane.offset, name);
  json["pose"] = numbers_json(surface.T_map_surface.matrix(), name);
  json["area_m2"] = finite(surface.area_m2, name);
  json["inliers"] = surface.inliers;
  json["rms_m"] = finite(surface.rms_m, name);
  json["covariance"] = numbers_json(surface.covariance, name);
  json["normal_std_deg"] = finite(surface.normal_std_rad() * deg_per_rad, name);
  json["offset_std_m"] = finite(surface.offset_std_m(), name);
  json["born"] = surface.born;
  json["revision"] = surface.revision;
  json["parents"] = surface.parents;
  json["rings"] = polygons_json(rings, surface, labels);
  json["triangles"] = (rings.triangles.size() - triangles_before) / 3;
  return json;
}

/// Removed objects, their successors (0: none), and the revisions of appearance and removal.
Json departures_json(const DepartureLog& departures, std::uint64_t since, Departure::Of of) {
  Json list = Json::array();
  departures.for_each_since(since, [&](const Departure& one) {
    if (one.of == of) list.push_back(Json::array({one.id, one.into, one.born, one.revision}));
  });
  return list;
}

template <typename Heir>
Json heirs_json(const std::vector<Heir>& heirs) {
  Json list = Json::array();
  for (const Heir& heir : heirs) list.push_back(Json::array({heir.before, heir.now}));
  return list;
}

/// `or_unseen`: area not observed by the other map may still exist, and counts as shared.
Json shares_json(const std::vector<SurfaceDifference>& surfaces, bool or_unseen) {
  Json list = Json::array();
  for (const SurfaceDifference& one : surfaces) {
    const double there = one.shared_m2 + (or_unseen ? one.unseen_m2 : 0);
    const double share = one.area_m2 > 0 ? std::clamp(there / one.area_m2, 0.0, 1.0) : 1;
    list.push_back(Json::array({one.id, std::round(share * 1e4) / 1e4, one.other}));
  }
  return list;
}

Json changes_json(const PageMap& map) {
  if (const auto* changes = std::get_if<MapChanges>(&map.changes)) {
    return {{"by", "ids"},
            {"since", changes->since},
            {"appeared", changes->appeared},
            {"changed", changes->changed},
            {"gone", changes->gone},
            {"merged", heirs_json(changes->merged)},
            {"split", heirs_json(changes->split)},
            {"cylinders_appeared", changes->cylinders_appeared},
            {"cylinders_gone", changes->cylinders_gone}};
  }
  if (const auto* difference = std::get_if<MapDifference>(&map.changes)) {
    return {{"by", "place"},
            {"before", shares_json(difference->before, true)},
            {"after", shares_json(difference->after, false)}};
  }
  return nullptr;
}

Json cylinder_json(const Cylinder& cylinder) {
  const std::string name = "cylinder " + std::to_string(cylinder.id);
  return {{"id", cylinder.id},
          {"axis_point", numbers_json(cylinder.axis_point, name)},
          {"axis", numbers_json(cylinder.axis, name)},
          {"radius_m", finite(cylinder.radius_m, name)},
          {"length_m", finite(cylinder.length_m, name)},
          {"start", numbers_json(cylinder.start, name)},
          {"span_rad", finite(cylinder.span_rad, name)},
          {"inliers", cylinder.inliers},
          {"rms_m", finite(cylinder.rms_m, name)},
          {"born", cylinder.born},
          {"revision", cylinder.revision}};
}

}  // namespace

std::int32_t page_polygon_steps(double coordinate, SurfaceId id) {
  const double steps = finite(coordinate, id) / polygon_step_m;
  return static_cast<std::int32_t>(std::lround(std::clamp(steps, -2e9, 2e9)));
}

void add_up(PageBlock& block, const Eigen::Vector3d& up) {
  const Eigen::Vector3d to = up.normalized();
  // So that heights in the page and its slices are those of up.hpp.
  const Eigen::Quaterniond R_upright_map = upright(to);
  block.json["up"] = {to.x(), to.y(), to.z()};
  block.json["R_upright_map"] = {R_upright_map.x(), R_upright_map.y(), R_upright_map.z(), R_upright_map.w()};
}

void add_surfaces(PageBlock& block, const PageMap& map, std::uint64_t departed_since) {
  const Snapshot& snapshot = *map.snapshot;
  Rings rings;
  Json surfaces = Json::array(), cylinders = Json::array();
  for (const SurfacePtr& surface : snapshot.surfaces) {
    const auto labels = map.edges.find(surface->id);
    surfaces.push_back(surface_json(rings, *surface, labels == map.edges.end() ? nullptr : &labels->second));
  }
  for (const CylinderPtr& cylinder : snapshot.cylinders) cylinders.push_back(cylinder_json(*cylinder));
  block.json["surfaces"] = std::move(surfaces);
  block.json["cylinders"] = std::move(cylinders);
  if (!map.stairs.empty()) block.json["stairs"] = Json::parse(stairs_json(map.stairs));
  block.json["departed_surfaces"] =
      departures_json(snapshot.departures, departed_since, Departure::Of::surface);
  block.json["departed_cylinders"] =
      departures_json(snapshot.departures, departed_since, Departure::Of::cylinder);
  block.json["changes"] = changes_json(map);
  block.json["ring_step_m"] = polygon_step_m;
  block.add("ring_u", differences(rings.u));
  block.add("ring_v", differences(rings.v));
  block.add("ring_edges", rings.edges);
  block.add("triangles", differences(rings.triangles));
}

}  // namespace octosurf::io
