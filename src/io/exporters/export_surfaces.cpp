#include "geometry/directions.hpp"
#include "geometry/triangulate.hpp"
#include "io/exporters/export_formats.hpp"
#include "io/new_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>

namespace octosurf {
namespace {

void check_export(const std::filesystem::path& file, const std::string& ending,
                  const ExportOptions& options) {
  if (ending != ".json" && ending != ".ply" && ending != ".glb")
    throw Error(Error::Kind::usage, file.string(), "no such format", "end the name in .json, .ply or .glb");
  geometry::require_direction(options.up, "up");
  if (ending != ".json" && options.parts.size() != 1)
    throw Error(Error::Kind::usage, file.string(), ending + " holds one kind of thing at a time",
                "ask for one of them, or write .json");
}

template <typename Value>
const std::vector<Value>& find_or_empty(const std::map<SurfaceId, std::vector<Value>>& all, SurfaceId id) {
  static const std::vector<Value> nothing;
  const auto found = all.find(id);
  return found == all.end() ? nothing : found->second;
}

}  // namespace

bool io::ExportJob::wants(ExportPart part) const {
  return std::ranges::find(options.parts, part) != options.parts.end();
}
const std::vector<ConvexPiece>& io::ExportJob::convex(SurfaceId id) const {
  return find_or_empty(options.convex, id);
}
const std::vector<Eigen::Vector3d>& io::ExportJob::points_of(SurfaceId id) const {
  return find_or_empty(options.points, id);
}

double io::finite(double value, const std::string& what) {
  if (std::isfinite(value)) return value;
  throw Error(Error::Kind::data, what, "holds a number that is not finite",
              "build the map anew from its scans");
}

double io::finite(double value, SurfaceId id) {
  return std::isfinite(value) ? value : io::finite(value, "surface " + std::to_string(id));
}

Error io::nothing_to_write(const std::filesystem::path& file) {
  return Error(Error::Kind::data, file.string(), "there is nothing to put into it",
               "the map has no surfaces with such parts; .json can be empty");
}

Eigen::Vector3d io::tidy(const Eigen::Vector3d& point) {
  // Beyond 10⁶ m a double has no nanometres to round to.
  return point.unaryExpr([](double x) {
    return std::abs(x) < 1e6 ? std::round(x * 1e9) / 1e9 + 0.0 : x;  // + 0.0: no −0
  });
}

namespace io {
namespace {

void append_fan(const std::vector<Eigen::Vector3d>& ring, Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  for (std::uint32_t i = 2; i < ring.size(); ++i) mesh.triangles.push_back({first, first + i - 1, first + i});
}

Mesh mesh_of(const ExportJob& job, const Surface& surface) {
  const ExportPart part = job.options.parts.front();
  if (part == ExportPart::polygons) return flat(surface, surface.polygons);
  if (part == ExportPart::meshes) return extrude(surface, job.options.mesh_thickness);
  Mesh mesh;
  if (part == ExportPart::points) mesh.vertices = job.points_of(surface.id);
  if (part == ExportPart::convex)
    for (const ConvexPiece& piece : job.convex(surface.id)) append_fan(piece.vertices, mesh);
  return mesh;
}

// PLY not by a library: PCL's writer does not report failed writes, and most readers find no faces in
// assimp's PLY files.

template <class... Values>
void put(std::ostream& out, const Values&... values) {
  (out.write(reinterpret_cast<const char*>(&values), sizeof(values)), ...);
}

void put_vertex(std::ostream& out, const Eigen::Vector3d& position, const std::array<float, 3>& color) {
  for (const double coordinate : position) put(out, static_cast<float>(coordinate));
  for (const float channel : color) put(out, static_cast<std::uint8_t>(std::lround(255 * channel)));
}

void put_header(std::ostream& out, const std::vector<Shape>& shapes, bool points) {
  std::size_t vertices = 0, faces = 0;
  for (const Shape& shape : shapes) {
    vertices += shape.mesh.vertices.size();
    faces += shape.mesh.triangles.size();
  }
  constexpr bool little = std::endian::native == std::endian::little;
  out << "ply\nformat " << (little ? "binary_little_endian" : "binary_big_endian") << " 1.0\n"
      << "element vertex " << vertices << '\n';
  for (const char* name : {"x", "y", "z"}) out << "property float " << name << '\n';
  for (const char* name : {"red", "green", "blue"}) out << "property uchar " << name << '\n';
  if (points)
    out << "property uint label\n";
  else
    out << "element face " << faces << "\nproperty list uchar int vertex_indices\n";
  out << "end_header\n";
}

void put_points(std::ostream& out, const std::vector<Shape>& shapes) {
  for (const Shape& shape : shapes)
    for (const Eigen::Vector3d& point : shape.mesh.vertices) {
      put_vertex(out, point, shape.color);
      put(out, static_cast<std::uint32_t>(shape.id));
    }
}

void put_faces(std::ostream& out, const std::vector<Shape>& shapes) {
  for (const Shape& shape : shapes)
    for (const Eigen::Vector3d& vertex : shape.mesh.vertices) put_vertex(out, vertex, shape.color);
  std::uint32_t first = 0;
  for (const Shape& shape : shapes) {
    for (const auto& corners : shape.mesh.triangles) {
      put(out, std::uint8_t{3});
      for (const std::uint32_t corner : corners) put(out, static_cast<std::int32_t>(first + corner));
    }
    first += static_cast<std::uint32_t>(shape.mesh.vertices.size());
  }
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

void write_ply(const std::vector<Shape>& shapes, bool points, std::ostream& out) {
  put_header(out, shapes, points);
  points ? put_points(out, shapes) : put_faces(out, shapes);
}

}  // namespace io

void export_surfaces(const Snapshot& snapshot, const std::filesystem::path& file,
                     const ExportOptions& options) {
  const std::string ending = io::ending_of(file);
  check_export(file, ending, options);
  const io::ExportJob job{snapshot, options};
  io::write_file(file, options.force, [&](std::ostream& out) {
    if (ending == ".json") return io::write_json(job, out);
    const std::vector<io::Shape> shapes = io::make_shapes(job);
    if (shapes.empty()) throw io::nothing_to_write(file);
    if (ending == ".ply") return io::write_ply(shapes, job.wants(ExportPart::points), out);
    io::write_glb(shapes, job, out);
  });
}

}  // namespace octosurf
