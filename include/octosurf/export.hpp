#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/boundary.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// What of the surfaces goes into a file.
enum class ExportPart { polygons, meshes, convex, circles, points };
/// By ExportPart, as `export --what` takes them.
inline constexpr std::array<std::string_view, 5> export_part_names{"polygons", "meshes", "convex", "circles",
                                                                   "points"};

/// How export_surfaces() writes.
struct ExportOptions {
  /// .json: any number, added to the polygons that are always there. Others: exactly one;
  /// .ply, .glb: any, .obj, .stl: any but points, .csv: polygons (a row per surface), circles or
  /// points (a row each).
  std::vector<ExportPart> parts{ExportPart::polygons};
  double mesh_thickness = 0.02;                   ///< m, of meshes
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, of .glb
  bool force = false;                             ///< write over a file that exists
};

/// A point of the map and whose it is.
struct SurfacePoint {
  SurfaceId surface = 0;  ///< 0: pending
  Eigen::Vector3d point;  ///< map frame
};

/// Something else to be shown beside the surfaces: where feet stand, say. Map frame.
struct NamedMesh {
  std::string name;              ///< of the object in the file
  std::array<float, 3> color{};  ///< RGB in [0, 1]
  Mesh mesh;                     ///< its triangles
};

/// What a snapshot does not hold; only the requested parts are read. Points of surfaces the snapshot
/// does not have are left out, as are pending ones.
struct ExportExtras {
  std::map<SurfaceId, std::vector<ConvexPiece>> convex;  ///< convex_pieces() by surface
  std::map<SurfaceId, std::vector<Circle>> circles;      ///< circles() by surface
  std::vector<SurfacePoint> points;                      ///< any order
  /// label_edges() of the snapshot's surfaces; goes into .json where there is one.
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  std::vector<NamedMesh> meshes;  ///< .glb: further objects
};

/// Writes the surfaces to `file` in the format its ending names: .json (docs/formats.md §2), .ply, .glb,
/// .obj (with an .mtl beside it), .stl, .csv.
///
/// .json also has `"cylinders"`: {"id", "axis_point", "axis", "radius_m", "length_m", "span_deg", "start",
/// "inliers", "rms_m", "revision"} each, as in cylinder.hpp.
///
/// 1. Map frame, metres; also in .glb, where viewers expect y up: its root node turns `up` there.
/// 2. .json and .csv hold positions to 1e-9 m and all else to a double's last digit, mesh formats
///    32-bit floats.
/// 3. One mesh or object `surface_<id>` per surface in its colour (.glb, .obj); .ply has a colour per
///    vertex, .stl has triangles only.
/// 4. `polygons`, `convex` and `circles` are flat (triangles counter-clockwise seen from the
///    normal's tip, circles as 32-gons), `meshes` closed (extrude()). .obj, .glb and .stl do not keep
///    vertices at one place apart.
/// 5. The file is complete or not there: it is written beside its place and renamed.
/// Throws Error(usage) for an ending or a part it cannot write, or a file that exists without
/// `force`; Error(data) for numbers that are not finite and labels of
/// other polygons; Error(output) if it cannot be written.
void export_surfaces(const Snapshot& snapshot, const std::filesystem::path& file,
                     const ExportOptions& options = {}, const ExportExtras& extras = {});

/// From where a picture is taken; all but `top` look from outside at the middle of the map.
enum class ViewFrom { iso, top, front, back, left, right };
/// By ViewFrom, as `view --from` takes them.
inline constexpr std::array<std::string_view, 6> view_names{"iso", "top", "front", "back", "left", "right"};

/// Colours of edges in pictures (view --edges): green, red, blue, orange.
inline constexpr std::array<std::array<float, 3>, edge_kind_names.size()> edge_colors{
    {{0.0F, 0.6F, 0.2F}, {0.85F, 0.1F, 0.15F}, {0.1F, 0.3F, 0.95F}, {1.0F, 0.6F, 0.0F}}};

/// How render_png() draws.
struct PictureOptions {
  int width = 1280;                               ///< pixels, 16 … 16384
  int height = 960;                               ///< likewise
  ViewFrom from = ViewFrom::iso;                  ///< front looks along +y, left along +x, top has +y upward
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame; see render_png()
  std::optional<Eigen::Vector3d> eye;             ///< map frame; instead of `from`
  std::optional<Eigen::Vector3d> target;          ///< map frame; empty: the middle of the map
  /// Leave out surfaces seen from behind, so that one looks past ceilings and near walls into rooms.
  bool cut = true;
  std::vector<Eigen::Vector3d> points;  ///< map frame; drawn as grey dots
  /// label_edges() of the snapshot's surfaces; where there are any, edges are lines in their kind's colour.
  std::map<SurfaceId, std::vector<PolygonEdges>> edges;
  std::vector<NamedMesh> meshes;  ///< drawn like the surfaces
  bool force = false;             ///< write over a file that exists
};

/// Renders the surfaces' polygons as a PNG: each in its colour, shaded, with dark outlines, over a
/// grid of 1 m at the height of the lowest surfaces. Framed on the 2 to 98 % extent, so that stray surfaces
/// do not shrink the rest. Same input, same picture. Where `up` is not +z, it is the picture of the map
/// turned by upright(up) (up.hpp): x, y and z of `from` are the turned map's.
/// Throws Error(usage) for nonsense options or a file that exists without `force`, Error(data) for edge
/// labels of other polygons, Error(output) if it cannot be written. A snapshot without surfaces gives an
/// empty picture.
void render_png(const Snapshot& snapshot, const std::filesystem::path& file,
                const PictureOptions& options = {});

}  // namespace octosurf
