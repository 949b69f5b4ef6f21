#include "io/exporters/export_formats.hpp"
#include "io/exporters/stairs_json.hpp"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>

namespace octosurf::io {
namespace {

using Json = nlohmann::ordered_json;

/// A list of what `json_of` makes of each element.
template <class List, class JsonOf>
Json list_of(const List& list, const JsonOf& json_of) {
  Json array = Json::array();
  for (const auto& element : list) array.push_back(json_of(element));
  return array;
}

Json points_json(const std::vector<Eigen::Vector3d>& points) {
  return list_of(points, [](const Eigen::Vector3d& point) { return tidy(point); });
}

Json ring_json(const Ring2& ring, const Surface& surface) {
  return list_of(ring, [&](const Eigen::Vector2d& uv) { return tidy(surface.to_map(uv)); });
}

/// Row by row.
template <class Matrix>
Json numbers_json(const Matrix& matrix) {
  return list_of(matrix.template reshaped<Eigen::RowMajor>(), [](double number) { return number; });
}

Json polygons_json(const Surface& surface) {
  const auto ring = [&](const Ring2& r) { return ring_json(r, surface); };
  return list_of(surface.polygons, [&](const Polygon& polygon) {
    return Json{{"outer", ring(polygon.outer)}, {"holes", list_of(polygon.holes, ring)}};
  });
}

Json gap_json(const Gap& gap, const Surface& surface) {
  return {{"kind", ground_name(gap.kind)},
          {"bridged", gap.bridged},
          {"width_m", gap.width_m},
          {"outline", ring_json(gap.outline.outer, surface)}};
}

Json piece_json(const ConvexPiece& piece) {
  return {{"vertices", points_json(piece.vertices)},
          {"A", list_of(piece.A.rowwise(), [](const auto& row) { return numbers_json(row); })},
          {"b", numbers_json(piece.b)}};
}

/// A float's digits, not those of the double it converts to.
double channel_json(float channel) { return std::round(static_cast<double>(channel) * 1e6) / 1e6; }

Json surface_json(const ExportJob& job, const Surface& surface) {
  const SurfaceId id = surface.id;
  Json json{{"id", id},
            {"color", list_of(surface.color, channel_json)},
            {"plane", {{"normal", surface.plane.normal}, {"offset", surface.plane.offset}}},
            {"T_map_surface", numbers_json(surface.T_map_surface.matrix())},
            {"area_m2", surface.area_m2},
            {"inliers", surface.inliers},
            {"rms_m", surface.rms_m},
            {"covariance", numbers_json(surface.covariance)},
            {"normal_std_deg", surface.normal_std_rad() * 180 / std::numbers::pi},
            {"offset_std_m", surface.offset_std_m()},
            {"revision", surface.revision},
            {"parents", surface.parents},
            {"polygons", polygons_json(surface)}};
  const auto gaps = job.options.gaps.find(id);
  json["gaps"] = list_of(gaps == job.options.gaps.end() ? std::vector<Gap>() : gaps->second,
                         [&](const Gap& gap) { return gap_json(gap, surface); });
  if (job.with_boundary) json["boundary"] = points_json(surface.boundary);
  if (job.wants(ExportPart::meshes)) {
    const Mesh mesh = extrude(surface, job.options.mesh_thickness);
    json["mesh"] = {{"vertices", points_json(mesh.vertices)}, {"triangles", mesh.triangles}};
  }
  if (job.wants(ExportPart::convex)) json["convex"] = list_of(job.convex(id), piece_json);
  if (job.wants(ExportPart::points)) json["points"] = points_json(job.points_of(id));
  return json;
}

/// JSON has no number that is not finite.
void require_finite(const Json& json, const std::string& what) {
  if (json.is_number_float()) finite(json.get<double>(), what);
  if (json.is_structured())
    for (const Json& element : json) require_finite(element, what);
}

/// One by one: the text of a large map may not fit into memory as one document.
template <class List, class JsonOf>
void write_each(std::ostream& out, const List& list, const char* what, const JsonOf& json_of) {
  const char* separator = "\n";
  for (const auto& element : list) {
    const Json json = json_of(*element);
    require_finite(json, what + std::to_string(element->id));
    out << std::exchange(separator, ",\n") << json;
  }
}

}  // namespace

void write_json(const ExportJob& job, std::ostream& out) {
  out << R"({"format":"octosurf-surfaces","version":1,"resolution":)"
      << Json(finite(job.snapshot.resolution, "resolution"));
  if (const Eigen::Vector3d& origin = job.options.origin; !origin.isZero(0))
    out << R"(,"origin":)" << Json(origin);
  out << R"(,"revision":)" << job.snapshot.revision << R"(,"surfaces":[)";
  write_each(out, job.snapshot.surfaces, "surface ",
             [&](const Surface& surface) { return surface_json(job, surface); });
  out << "\n],\"cylinders\":[";
  write_each(out, job.snapshot.cylinders, "cylinder ",
             [](const Cylinder& cylinder) { return Json(cylinder); });
  out << "\n]";
  if (const auto& found = job.options.stairs)
    out << ",\"stairs\":" << Json(found->stairs) << ",\"single_steps\":" << Json(found->single_steps);
  out << "}\n";
}

}  // namespace octosurf::io
