#pragma once

#include "io/files.hpp"
#include "room_snapshot.hpp"

#include <octosurf/export.hpp>

namespace octosurf::test {

/// A room, and parts to export that come from outside a snapshot.
class ExportTest : public FolderTest {
 protected:
  ExportTest() {
    for (const SurfacePtr& surface : room_.surfaces)
      extras_.points[surface->id] = {surface->to_map({0.1, 0.2}), surface->to_map({0.2, 0.1})};
    extras_.points[0] = extras_.points[999999] = {Eigen::Vector3d(9, 9, 9)};  // pending; of no surface
    const Surface& table = *room_.surfaces[6];
    ConvexPiece piece;
    piece.A.resize(4, 2);
    piece.A << 1, 0, 0, 1, -1, 0, 0, -1;
    piece.b.resize(4);
    piece.b << 1.6, 1, 0, 0;
    for (const Eigen::Vector2d& uv : table.polygons[0].outer) piece.vertices.push_back(table.to_map(uv));
    extras_.convex[table.id] = {piece};
  }
  fs::path write(const std::string& name, std::vector<ExportPart> parts) const {
    const std::size_t before = count_files();
    ExportOptions options = extras_;
    options.parts = std::move(parts);
    export_surfaces(room_, path(name), options);
    EXPECT_EQ(count_files(), before + 1);
    return path(name);
  }

  double total_area() const {
    double sum = 0;
    for (const SurfacePtr& surface : room_.surfaces) sum += surface->area_m2;
    return sum;
  }

  Snapshot room_ = make_room();
  ExportOptions extras_;
};

inline double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const auto& v = mesh.vertices;
    sum += (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).norm() / 2;
  }
  return sum;
}

/// Of a closed mesh.
inline double volume(const Mesh& mesh) {
  double six = 0;
  for (const auto& t : mesh.triangles) {
    six += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  }
  return six / 6;
}

inline Eigen::AlignedBox3d bounds(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  return box;
}

}  // namespace octosurf::test
