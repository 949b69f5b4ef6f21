#include "io/exporters/export_formats.hpp"
#include "io/exporters/stairs_json.hpp"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

namespace octosurf::io {
namespace {

using Json = nlohmann::ordered_json;

Json points_json(const std::vector<Eigen::Vector3d>& points, SurfaceId id) {
  Json list = Json::array();
  for (const Eigen::Vector3d& point : points) list.push_back(tidy(point, id));
  return list;
}

Json ring_json(const Ring2& ring, const Surface& surface) {
  Json list = Json::array();
  for (const Eigen::Vector2d& uv : ring) list.push_back(tidy(surface.to_map(uv), surface.id));
  return list;
}

Json edges_json(const std::vector<EdgeKind>& edges) {
  Json list = Json::array();
  for (const EdgeKind kind : edges) list.push_back(edge_kind_name(kind));
  return list;
}

Json polygons_json(const ExportJob& job, const Surface& surface) {
  const auto labels = job.extras.edges.find(surface.id);
  const bool labelled = labels != job.extras.edges.end();
  if (labelled) require_labels_of(surface, labels->second);
  Json list = Json::array();
  for (std::size_t p = 0; p < surface.polygons.size(); ++p) {
    const Polygon& polygon = surface.polygons[p];
    Json holes = Json::array(), hole_edges = Json::array();
    for (const Ring2& hole : polygon.holes) holes.push_back(ring_json(hole, surface));
    list.push_back({{"outer", ring_json(polygon.outer, surface)}, {"holes", std::move(holes)}});
    if (!labelled) continue;
    for (const std::vector<EdgeKind>& edges : labels->second[p].holes)
      hole_edges.push_back(edges_json(edges));
    list.back()["outer_edges"] = edges_json(labels->second[p].outer);
    list.back()["hole_edges"] = std::move(hole_edges);
  }
  return list;
}

Json gaps_json(const std::vector<Gap>& gaps, const Surface& surface) {
  Json list = Json::array();
  for (const Gap& gap : gaps)
    list.push_back({{"kind", ground_name(gap.kind)},
                    {"bridged", gap.bridged},
                    {"width_m", finite(gap.width_m, surface.id)},
                    {"outline", ring_json(gap.outline.outer, surface)}});
  return list;
}

Json convex_json(const std::vector<ConvexPiece>& pieces, SurfaceId id) {
  Json list = Json::array();
  for (const ConvexPiece& piece : pieces) {
    Json a = Json::array(), b = Json::array();
    for (Eigen::Index row = 0; row < piece.A.rows(); ++row) {
      a.push_back(Json::array({finite(piece.A(row, 0), id), finite(piece.A(row, 1), id)}));
      b.push_back(finite(piece.b[row], id));
    }
    list.push_back({{"vertices", points_json(piece.vertices, id)}, {"A", std::move(a)}, {"b", std::move(b)}});
  }
  return list;
}

Json circles_json(const std::vector<Circle>& circles, SurfaceId id) {
  Json list = Json::array();
  for (const Circle& circle : circles) {
    list.push_back({{"center", tidy(circle.center, id)}, {"radius", finite(circle.radius, id)}});
  }
  return list;
}

Json mesh_json(const Mesh& mesh, SurfaceId id) {
  return {{"vertices", points_json(mesh.vertices, id)}, {"triangles", mesh.triangles}};
}

Json pose_json(const Surface& surface) {
  Json list = Json::array();
  for (int i = 0; i < 16; ++i) list.push_back(finite(surface.T_map_surface(i / 4, i % 4), surface.id));
  return list;
}

Json covariance_json(const Surface& surface) {
  Json list = Json::array();
  for (int i = 0; i < 9; ++i) list.push_back(finite(surface.covariance(i / 3, i % 3), surface.id));
  return list;
}

Json surface_json(const ExportJob& job, const Surface& surface) {
  const SurfaceId id = surface.id;
  Json color = Json::array();  // a float's digits, not those of the double it converts to
  for (const float c : surface.color) color.push_back(std::round(finite(c, id) * 1e6) / 1e6);
  const Eigen::Vector3d& n = surface.plane.normal;
  Json normal = Json::array({finite(n.x(), id), finite(n.y(), id), finite(n.z(), id)});

  Json json;
  json["id"] = id;
  json["color"] = std::move(color);
  json["plane"] = {{"normal", std::move(normal)}, {"offset", finite(surface.plane.offset, id)}};
  json["T_map_surface"] = pose_json(surface);
  json["area_m2"] = finite(surface.area_m2, id);
  json["inliers"] = surface.inliers;
  json["rms_m"] = finite(surface.rms_m, id);
  json["covariance"] = covariance_json(surface);
  json["normal_std_deg"] = finite(surface.normal_std_rad() * 180 / std::numbers::pi, id);
  json["offset_std_m"] = finite(surface.offset_std_m(), id);
  json["revision"] = surface.revision;
  json["parents"] = surface.parents;
  json["polygons"] = polygons_json(job, surface);
  if (const auto gaps = job.extras.gaps.find(id); gaps != job.extras.gaps.end())
    json["gaps"] = gaps_json(gaps->second, surface);
  if (job.with_boundary) json["boundary"] = points_json(surface.boundary, id);
  if (job.wants(ExportPart::meshes)) {
    json["mesh"] = mesh_json(extrude(surface, job.options.mesh_thickness), id);
  }
  if (job.wants(ExportPart::convex)) json["convex"] = convex_json(job.convex(id), id);
  if (job.wants(ExportPart::circles)) json["circles"] = circles_json(job.circles(id), id);
  if (job.wants(ExportPart::points)) json["points"] = points_json(job.points_of(id), id);
  return json;
}

Json cylinder_json(const Cylinder& cylinder) {
  const auto number = [&](double value) { return finite(value, "cylinder " + std::to_string(cylinder.id)); };
  const auto vector = [&](const Eigen::Vector3d& v) {
    return Json::array({number(v.x()), number(v.y()), number(v.z())});
  };
  return {{"id", cylinder.id},
          {"axis_point", vector(tidy(cylinder.axis_point))},
          {"axis", vector(cylinder.axis)},
          {"radius_m", number(cylinder.radius_m)},
          {"length_m", number(cylinder.length_m)},
          {"span_deg", number(cylinder.span_rad * 180 / std::numbers::pi)},
          {"start", vector(cylinder.start)},
          {"inliers", cylinder.inliers},
          {"rms_m", number(cylinder.rms_m)},
          {"revision", cylinder.revision}};
}

}  // namespace

void write_json(const ExportJob& job, std::ostream& out) {
  out << R"({"format":"octosurf-surfaces","version":1,"resolution":)"
      << Json(finite(job.snapshot.resolution, 0));
  if (const Eigen::Vector3d& origin = job.options.origin; !origin.isZero(0))
    out << R"(,"origin":)" << Json({origin.x(), origin.y(), origin.z()});
  out << R"(,"revision":)" << job.snapshot.revision << R"(,"surfaces":[)";
  // Surface by surface: the text of a large map may not fit into memory as one document.
  const char* separator = "\n";
  for (const SurfacePtr& surface : job.snapshot.surfaces) {
    out << separator << surface_json(job, *surface);
    separator = ",\n";
  }
  out << "\n],\"cylinders\":[";
  separator = "\n";
  for (const CylinderPtr& cylinder : job.snapshot.cylinders) {
    out << separator << cylinder_json(*cylinder);
    separator = ",\n";
  }
  out << "\n]";
  if (const auto& found = job.extras.stairs)
    out << ",\"stairs\":" << stairs_json(found->stairs) << ",\"steps\":" << steps_json(found->single_steps);
  out << "}\n";
}

}  // namespace octosurf::io
