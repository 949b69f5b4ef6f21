#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::io {

/// Pinhole camera without distortion, pixels. fy may be negative (y up, as in ICL-NUIM's .K).
struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// 3×3 K in three lines or one, or `fx fy cx cy`. Throws Error(data) for anything else, including
/// skew and distortion.
Intrinsics read_intrinsics(const std::filesystem::path& file);

/// 16-bit gray, row-major.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<std::uint16_t> pixels;
};

/// Maximum pixels along a side of an image.
inline constexpr std::uint32_t largest_side = 8192;

/// PNG or PGM (P5, P2), by content, at most 8192 × 8192. Throws Error(data) for files that are empty,
/// truncated, damaged, or not 16-bit gray.
DepthImage read_depth_image(const std::filesystem::path& file);

/// The same for a PNG in memory, which may take `largest_size` bytes with its points; `where` names it in
/// messages.
DepthImage read_png(std::string_view bytes, const std::string& where, std::uint64_t largest_size);

/// True if the header is complete and of a picture other than a 16-bit depth image.
bool is_picture(const std::filesystem::path& file);

/// Points in the camera's frame (x right, y down, z along the optical axis), metres, one per pixel
/// that has a reading. `scale`: units per metre.
std::vector<Eigen::Vector3f> back_project(const DepthImage& image, const Intrinsics& camera, double scale);

}  // namespace octosurf::io
