#pragma once

#include <filesystem>

namespace octosurf::io {

enum class FileKind { image, pcd, ply, velodyne, graph, bag, occupancy_map, unknown };

/// By content, or by extension for files without a signature (velodyne) or with a damaged one. Never throws.
FileKind kind_of(const std::filesystem::path& file) noexcept;

/// macOS writes ._NAME beside each file on disks of others.
inline bool is_hidden(const std::filesystem::path& file) { return file.filename().string().starts_with('.'); }

}  // namespace octosurf::io
