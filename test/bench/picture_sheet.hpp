#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace octosurf::bench {

/// 8-bit RGB, rows from the top.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Throws Error(data) if it cannot be decoded. JPEG only where libjpeg was there at build time.
Picture read_picture(const std::filesystem::path& file);

/// The recording's colour picture of a frame: frame-NNNNNN.color.{png,jpg} beside the depth images or in
/// `color_reference`, of the nearest frame that has one; none if there is no such picture.
struct ColorFrame {
  std::size_t frame = 0;
  std::filesystem::path file;
};
std::optional<ColorFrame> color_frame_near(const std::filesystem::path& recording, std::size_t frame);

/// Two columns, row by row, each picture scaled to fit into width × height.
Picture sheet_of(const std::vector<Picture>& pictures, int width, int height);

/// Throws Error(output).
void write_picture(const Picture& picture, const std::filesystem::path& file);

}  // namespace octosurf::bench
