#pragma once

#include "alignment/seen_patches.hpp"
#include "io/map_file/record_stream.hpp"

#include <Eigen/Geometry>
#include <cstdint>

namespace octosurf::io {

// Memory limits for reading a map file, by its size, so that a small file cannot exhaust a reader. Writers
// comply: if a map compresses better, they make the file longer (RecordWriter::finish()).

/// Of the stream. Real maps compress to a third … a seventh, planes without noise to a thirtieth.
inline constexpr Expansion map_stream{.free = std::uint64_t{4} << 20, .ratio = 12};
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
