#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/gaps.hpp>
#include <octosurf/pieces.hpp>
#include <octosurf/stairs.hpp>
#include <octosurf/surface.hpp>

namespace octosurf {

/// Which representation of the surfaces to write.
enum class ExportPart { polygons, meshes, convex, points };
/// By ExportPart, as `export --what` accepts them.
inline constexpr std::array<std::string_view, 4> export_part_names{"polygons", "meshes", "convex", "points"};

/// A further object to display, such as footprints. Map frame.
struct NamedMesh {
  std::string name;              ///< of the object in the file
  std::array<float, 3> color{};  ///< RGB in [0, 1]
  Mesh mesh;                     ///< its triangles
};

/// Options of export_surfaces(), and what a snapshot lacks, by surface.
struct ExportOptions {
  /// .json: any number, in addition to the polygons. .ply, .glb: exactly one.
  std::vector<ExportPart> parts{ExportPart::polygons};
  double mesh_thickness = 0.02;                   ///< m, of meshes
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame, of .glb
  /// Map::origin(), m: written to .json (`"origin"`) and .glb (`extras` of its root node) unless it is 0.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  bool force = false;                                          ///< overwrite an existing file
  std::map<SurfaceId, std::vector<ConvexPiece>> convex{};      ///< convex_pieces()
  std::map<SurfaceId, std::vector<Eigen::Vector3d>> points{};  ///< map frame
  std::vector<NamedMesh> meshes{};                             ///< .glb: further objects
  std::map<SurfaceId, std::vector<Gap>> gaps{};                ///< of GroundView, of .json
  std::optional<Stairs> stairs{};                              ///< of find_stairs(), of .json
};

/// Writes the surfaces to `file` in the format given by its extension: .json (docs/formats.md §2), .ply,
/// .glb.
///
/// 1. Map frame, metres; also in .glb, where viewers expect y up: its root node rotates `up` to y.
/// 2. .json has positions to 1e-9 m and all other numbers to a double's last digit, .ply and .glb 32-bit
///    floats.
/// 3. .glb has a mesh `surface_<id>` per surface in its colour, .ply a colour per vertex.
/// 4. `polygons` and `convex` are flat (triangles counter-clockwise seen from the normal's tip), `meshes`
///    closed (extrude()).
/// 5. The file is complete or absent: written to a temporary file and renamed.
/// Throws Error(usage) for an unsupported extension or part, or an existing file without `force`; Error(data)
/// for numbers that are not finite; Error(output) if it cannot be written.
void export_surfaces(const Snapshot& snapshot, const std::filesystem::path& file,
                     const ExportOptions& options = {});

/// Where a picture is seen from: obliquely from above, or straight from above with +y upward.
enum class ViewFrom { iso, top };
/// By ViewFrom, as `view --from` accepts them.
inline constexpr std::array<std::string_view, 2> view_names{"iso", "top"};

/// Options of render_png().
struct PictureOptions {
  int width = 1280;                               ///< pixels, 16 … 16384
  int height = 960;                               ///< likewise
  ViewFrom from = ViewFrom::iso;                  ///< see there
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< map frame; see render_png()
  std::vector<NamedMesh> meshes;                  ///< drawn like the surfaces
  bool force = false;                             ///< overwrite an existing file
};

/// Renders the surfaces' polygons as a PNG, in parallel projection: each in its colour, shaded, with dark
/// outlines, over a grid of 1 m at the height of the lowest surfaces, framed on the 2 to 98 % extent.
/// Surfaces seen from behind are omitted, to look past ceilings and near walls. Deterministic. The map is
/// first turned by upright(up) (up.hpp). Throws Error(usage) for invalid options or an existing file without
/// `force`, Error(output).
void render_png(const Snapshot& snapshot, const std::filesystem::path& file,
                const PictureOptions& options = {});

}  // namespace octosurf
