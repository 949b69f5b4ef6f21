#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::simulation {

/// A terrain as a file holds it, turned so that z is up, in metres.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  double precision = 0;        ///< m: vertices that are meant to be one lie within this of each other
  std::size_t dropped = 0;     ///< triangles of the file narrower than `precision`
  std::size_t open_edges = 0;  ///< edges of one triangle only: through such a rim one may look into a solid
};

struct MeshOptions {
  /// Axis of the file that is up: x, y, z, -x, -y or -z. Empty: what a DAE says of itself, z for all others.
  std::string up;
  double scale = 1;  ///< m per unit of the file (a DAE's own unit is taken in before)

  /// Throws Error(usage) naming option, value and rule.
  void validate() const;
};

/// Reads an STL, OBJ, PLY or DAE (Assimp), told apart by its ending.
///
/// 1. Vertices within `precision` are one. It is 2⁻²⁰ of the largest coordinate: that of a float's 24 bits,
/// less
///    four that the arithmetic of turning and shifting parts costs, and of the six digits that text files
///    hold.
/// 2. Triangles that the welding makes narrower than `precision` are dropped and counted.
/// 3. Only the named file is opened, whatever it refers to (an OBJ's materials, a DAE's images).
/// Throws Error(data), naming the file, for anything else than 1 to 200,000 triangles with finite corners
/// whose extent is 0.1 m to 1 km: what lies outside is in other units or no terrain. Files above 64 MiB are
/// refused unread.
TriangleMesh read_mesh(const std::filesystem::path& file, const MeshOptions& options = {});

}  // namespace octosurf::simulation
