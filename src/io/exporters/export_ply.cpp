#include "io/exporters/export_formats.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace octosurf::io {
namespace {

// Not by a library: PCL's writer does not report failed writes, and most readers find no faces in assimp's
// PLY files.

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

void write_ply(const std::vector<Shape>& shapes, bool points, std::ostream& out) {
  put_header(out, shapes, points);
  points ? put_points(out, shapes) : put_faces(out, shapes);
}

}  // namespace octosurf::io
