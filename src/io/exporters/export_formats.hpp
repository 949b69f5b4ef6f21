#pragma once

#include <filesystem>
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
  bool with_boundary = true;

  bool wants(ExportPart part) const;
  const std::vector<ConvexPiece>& convex(SurfaceId id) const;
  const std::vector<Eigen::Vector3d>& points_of(SurfaceId id) const;
};

/// docs/formats.md §2, one surface per line.
void write_json(const ExportJob& job, std::ostream& out);

/// One surface in a mesh file; without triangles it is a set of points.
struct Shape {
  SurfaceId id = 0;
  std::array<float, 3> color{};
  Mesh mesh;
};

/// `polygons` of a surface, triangulated; counter-clockwise seen from the normal's tip.
Mesh flat(const Surface& surface, const std::vector<Polygon>& polygons);

/// Of the job's one part; surfaces without any of it are skipped.
std::vector<Shape> make_shapes(const ExportJob& job);

/// Binary, colours by vertex; points also with a label, the surface's id.
void write_ply(const std::vector<Shape>& shapes, bool points, std::ostream& out);

/// A mesh for each shape, and the options' meshes.
void write_glb(const std::vector<Shape>& shapes, const ExportJob& job, std::ostream& out);

/// `value` if it is finite; else throws Error(data) naming `what`.
double finite(double value, const std::string& what);
double finite(double value, SurfaceId id);  ///< of a surface

/// For formats that cannot be empty.
Error nothing_to_write(const std::filesystem::path& file);

/// A position, rounded to 1e-9 m to avoid digits like 0.30000000000000004 in text files.
Eigen::Vector3d tidy(const Eigen::Vector3d& point);

}  // namespace octosurf::io
