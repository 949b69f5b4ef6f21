#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"

#include <utility>

namespace octosurf::io {
namespace {

void append_fan(const std::vector<Eigen::Vector3d>& ring, Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  for (std::uint32_t i = 2; i < ring.size(); ++i) mesh.triangles.push_back({first, first + i - 1, first + i});
}

Mesh mesh_of(const ExportJob& job, const Surface& surface) {
  Mesh mesh;
  switch (job.options.parts.front()) {
    case ExportPart::polygons:
      return flat(surface, surface.polygons);
    case ExportPart::meshes:
      return extrude(surface, job.options.mesh_thickness);
    case ExportPart::convex:
      for (const ConvexPiece& piece : job.convex(surface.id)) append_fan(piece.vertices, mesh);
      return mesh;
    case ExportPart::points:
      mesh.vertices = job.points_of(surface.id);
  }
  return mesh;
}

}  // namespace

Mesh flat(const Surface& surface, const std::vector<Polygon>& polygons) {
  Mesh mesh;
  std::vector<Eigen::Vector2d> vertices;
  for (const Polygon& polygon : polygons) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const auto& t : geometry::triangulate(polygon, vertices)) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    for (const Eigen::Vector2d& uv : vertices) mesh.vertices.push_back(surface.to_map(uv));
  }
  return mesh;
}

std::vector<Shape> make_shapes(const ExportJob& job) {
  std::vector<Shape> shapes;
  for (const SurfacePtr& surface : job.snapshot.surfaces) {
    Shape shape{surface->id, surface->color, mesh_of(job, *surface)};
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& vertex : shape.mesh.vertices) sum += vertex;
    finite(sum.sum(), shape.id);
    if (!shape.mesh.vertices.empty()) shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace octosurf::io
