#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/export.hpp>

// One function per family of file formats; export_surfaces() chooses, checks and calls them.

namespace octosurf::io {

/// A validated export: `parts` fit the format.
struct ExportJob {
  const Snapshot& snapshot;
  const ExportOptions& options;
  const ExportExtras& extras;
  std::map<SurfaceId, std::vector<Eigen::Vector3d>> points;  ///< the extras' points by surface
  bool with_boundary = true;

  bool wants(ExportPart part) const;
  const std::vector<ConvexPiece>& convex(SurfaceId id) const;
  const std::vector<Circle>& circles(SurfaceId id) const;
  const std::vector<Eigen::Vector3d>& points_of(SurfaceId id) const;
};

/// docs/formats.md §2, one surface per line.
void write_json(const ExportJob& job, std::ostream& out);

/// A row per surface, circle or point.
void write_csv(const ExportJob& job, std::ostream& out);

/// .glb, .obj, .stl; writes `file` (and .obj's material file) itself.
void write_mesh_file(const ExportJob& job, const std::filesystem::path& file);

/// Binary, colours by vertex; points also with a label, the surface's id. Writes `file` itself.
void write_ply(const ExportJob& job, const std::filesystem::path& file);

/// One surface in a mesh file; without triangles it is a set of points.
struct Shape {
  SurfaceId id = 0;
  std::array<float, 3> color{};
  Mesh mesh;
};

/// `polygons` of a surface, triangulated; counter-clockwise seen from the normal's tip.
Mesh flat(const Surface& surface, const std::vector<Polygon>& polygons);

/// Shapes of `part`; surfaces without any of it are skipped.
std::vector<Shape> make_shapes(const ExportJob& job, ExportPart part);

/// `value` if it is finite; else throws Error(data) naming `what`.
double finite(double value, const std::string& what);
double finite(double value, SurfaceId id);  ///< of a surface

/// Throws Error(data) unless there is a label for every edge of the surface's polygons.
void require_labels_of(const Surface& surface, const std::vector<PolygonEdges>& edges);

/// ".json" of "FILE.JSON".
std::string ending_of(const std::filesystem::path& file);

/// For formats that cannot be empty.
Error nothing_to_write(const std::filesystem::path& file);

/// A position, rounded to 1e-9 m to avoid digits like 0.30000000000000004 in text files.
Eigen::Vector3d tidy(const Eigen::Vector3d& point);
Eigen::Vector3d tidy(const Eigen::Vector3d& point, SurfaceId id);  ///< finite, or Error(data)

}  // namespace octosurf::io
