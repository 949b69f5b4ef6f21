#pragma once

#include "evaluation/truth.hpp"
#include "simulation/fixture.hpp"
#include "simulation/mesh.hpp"
#include "support/polygons.hpp"

namespace octosurf::simulation::terrain {

inline double area(const evaluation::TrueFace& face) { return test::area(face.polygons); }

using Triangle3 = std::array<Eigen::Vector3d, 3>;
using Triangles = std::vector<Triangle3>;

/// Four corners, counter-clockwise seen from the front.
inline void add_quad(Triangles& triangles, const std::array<Eigen::Vector3d, 4>& c) {
  triangles.push_back({c[0], c[1], c[2]});
  triangles.push_back({c[0], c[2], c[3]});
}

/// Twelve triangles wound outwards: −z, +z, −y, +x, +y, −x, two each.
inline void add_box(Triangles& triangles, const Eigen::Vector3d& min, const Eigen::Vector3d& max,
                    const Eigen::Isometry3d& T = Eigen::Isometry3d::Identity()) {
  std::array<Eigen::Vector3d, 8> c;
  for (int i = 0; i < 8; ++i)
    c[i] =
        T * Eigen::Vector3d(i & 1 ? max.x() : min.x(), i & 2 ? max.y() : min.y(), i & 4 ? max.z() : min.z());
  add_quad(triangles, {c[0], c[2], c[3], c[1]});
  add_quad(triangles, {c[4], c[5], c[7], c[6]});
  add_quad(triangles, {c[0], c[1], c[5], c[4]});
  add_quad(triangles, {c[1], c[3], c[7], c[5]});
  add_quad(triangles, {c[3], c[2], c[6], c[7]});
  add_quad(triangles, {c[2], c[0], c[4], c[6]});
}

/// Steps of 17 by 29 cm, 1 m wide, rising toward +x from x = 1: boxes side by side on a ground sheet of 4 by
/// 2 m.
inline Triangles stair(int steps) {
  Triangles triangles;
  add_quad(triangles, {{{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {0, 2, 0}}});
  for (int k = 0; k < steps; ++k)
    add_box(triangles, {1 + 0.29 * k, 0.5, 0}, {1 + 0.29 * (k + 1), 1.5, 0.17 * (k + 1)});
  return triangles;
}

/// Corners a line each, after `before`; nine digits hold a float.
inline std::string corners(const Triangles& triangles, const char* before = "") {
  std::ostringstream out;
  out.precision(9);
  for (const auto& t : triangles)
    for (const auto& v : t) out << before << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  return out.str();
}

inline std::string stl(const Triangles& triangles) {
  std::string text = "solid terrain\n";
  for (const auto& t : triangles)
    text += "facet normal 0 0 0\nouter loop\n" + corners({t}, "vertex ") + "endloop\nendfacet\n";
  return text + "endsolid terrain\n";
}

inline std::string binary_stl(const Triangles& triangles) {
  std::string bytes(80, ' ');
  const auto add = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  add(static_cast<std::uint32_t>(triangles.size()));
  for (const auto& t : triangles) {
    add(std::array<float, 3>{0, 0, 0});
    for (const auto& v : t) add(std::array<float, 3>{float(v.x()), float(v.y()), float(v.z())});
    add(std::uint16_t{0});
  }
  return bytes;
}

/// A line for each triangle: what comes before, and the numbers of its corners from `first` on.
inline std::string numbers(const Triangles& triangles, const std::string& before, std::size_t first) {
  std::string text;
  for (std::size_t i = first; i < first + 3 * triangles.size(); i += 3)
    text += before + std::to_string(i) + ' ' + std::to_string(i + 1) + ' ' + std::to_string(i + 2) + '\n';
  return text;
}

inline std::string obj(const Triangles& triangles) {
  return corners(triangles, "v ") + numbers(triangles, "f ", 1);
}

inline std::string ply(const Triangles& triangles) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(3 * triangles.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n" +
         corners(triangles) + numbers(triangles, "3 ", 0);
}

/// `up` as COLLADA writes it (Y_UP, Z_UP), `unit` in metres.
inline std::string dae(const Triangles& triangles, const std::string& up, double unit) {
  std::ostringstream out;
  out << R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter=")"
      << unit << R"(" name="unit"/><up_axis>)" << up << R"(</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count=")"
      << 9 * triangles.size() << "\">" << corners(triangles) << R"(</float_array>
<technique_common><accessor source="#a" count=")"
      << 3 * triangles.size() << R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count=")"
      << triangles.size() << R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)"
      << numbers(triangles, "", 0) << R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";
  return out.str();
}

class TerrainTest : public FolderTest {
 protected:
  TriangleMesh mesh_of(const Triangles& triangles) const {
    return read_mesh(write("terrain.stl", stl(triangles)));
  }
};

}  // namespace octosurf::simulation::terrain
