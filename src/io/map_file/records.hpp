#pragma once

#include "alignment/alignment_state.hpp"
#include "alignment/seen_patches.hpp"
#include "io/map_file/map_rows.hpp"
#include "surfaces/map_state.hpp"

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace octosurf::map_file {
class Alignment;
class Cylinder;
class SeenPatches;
class Surface;
}  // namespace octosurf::map_file

namespace octosurf::io {

// Records of a map file. Reading throws Error(data) about `where` unless every number is present, finite,
// possible and consistent with the others and with `state`.

/// What a surface's numbers must be consistent with.
struct SurfaceLimits {
  Parameters parameters;
  std::uint64_t revision;
  SurfaceId next_id;
};
/// Without its inliers, which the reader takes from the octree: the `inliers` points with the record's id.
void write_surface(surfaces::SurfaceModel::State& surface, std::uint64_t inliers, map_file::Surface& record);
surfaces::SurfaceModel::State read_surface(map_file::Surface& record, const SurfaceLimits& limits,
                                           const std::string& where);
/// Requires that a surface's sums are those of its inliers.
void require_inliers(const surfaces::SurfaceModel::State& surface, std::uint64_t inliers,
                     const std::string& where);

/// Every voxel of a cylinder that is read holds a pending point near the lateral surface that supports no
/// other cylinder; surfaces and earlier cylinders are complete by then.
void write_cylinder(surfaces::CylinderModel cylinder, map_file::Cylinder& record);
surfaces::CylinderModel read_cylinder(map_file::Cylinder& record, const surfaces::MapState& state,
                                      const std::string& where);

void write_alignment(alignment::AlignmentState state, map_file::Alignment& record);
alignment::AlignmentState read_alignment(map_file::Alignment& record, const std::string& where);

/// Reading adds to `patches`, all of the one block.
void write_patch(alignment::SeenPatches::Change patch, map_file::SeenPatches& record);
void read_patches(map_file::SeenPatches& record, alignment::SeenPatches::Key block, const std::string& where,
                  alignment::SeenPatches& patches);

// Memory limits for reading a map file, by its size, so that a small file cannot exhaust a reader. Writers
// comply: if a map compresses better, they make the file longer (RowWriter::pad()).

/// Of memory, with the decoder's buffers 64 MiB and 64 times the file's size. Real maps take 12 … 31 times
/// theirs, of which the octree 4 … 11; most is the surfaces' hashes of their inliers.
inline constexpr Expansion map_memory{.free = std::uint64_t{40} << 20, .ratio = 64};

// Bytes in memory, upper bounds: hashes grow by doubling.
inline constexpr std::uint64_t pose_cost = 2 * sizeof(Eigen::Isometry3d);
inline constexpr std::uint64_t held_cost = 2 * sizeof(std::uint64_t);
inline constexpr std::uint64_t patch_cost = 2 * sizeof(alignment::SeenPatches::Change);
inline constexpr std::uint64_t inlier_cost = 200, waiting_cost = 16, surface_cost = 4096, vertex_cost = 60;
inline constexpr std::uint64_t removal_cost = 300;  // of it, of its record, and of its index entry
inline constexpr std::uint64_t check_cost = 200;    // of a vertex, while its surface is being read

}  // namespace octosurf::io
