#pragma once

#include <filesystem>

namespace octosurf::io {

enum class FileKind { image, pcd, ply, velodyne, graph, bag, occupancy_map, unknown };

/// By content; what has no signature of its own (velodyne) or is damaged at its start, by ending.
/// Never throws.
FileKind kind_of(const std::filesystem::path& file) noexcept;

}  // namespace octosurf::io
