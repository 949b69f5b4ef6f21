#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace octosurf::io {

/// Pinhole camera without distortion, pixels. fy may be negative (y up, as in ICL-NUIM's .K).
struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  bool operator==(const Intrinsics&) const = default;
};

/// 3×3 K in three lines or one, or `fx fy cx cy`. Throws Error(data) for anything else, including
/// skew and distortion.
Intrinsics read_intrinsics(const std::filesystem::path& file);
Intrinsics intrinsics_of(std::vector<double> numbers, const std::string& where);

/// "640x480", for messages.
std::string size_text(std::uint64_t width, std::uint64_t height);

/// Throws Error(data) naming `where` if the camera's images are of another size than width × height: its
/// principal point lies outside, or is off the middle by one factor both ways.
void require_same_size(const Intrinsics& camera, int width, int height, const std::string& where);

/// 16-bit gray, row-major.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<std::uint16_t> pixels;
  /// Not 0: a pixel p is at quant_a / (p − quant_b) m, else at p units.
  float quant_a = 0, quant_b = 0;

  double default_scale() const { return quant_a != 0 ? 1 : 1000; }
};

/// Maximum pixels along a side of an image.
inline constexpr std::uint32_t largest_side = 8192;

/// PNG or PGM (P5), by content, at most 8192 × 8192. Throws Error(data) for files that are empty,
/// truncated, damaged, or not 16-bit gray.
DepthImage read_depth_image(const std::filesystem::path& file);

/// The same for a PNG in memory, which may take `largest_size` bytes with its points; `where` names it in
/// messages.
DepthImage read_png(std::string_view bytes, const std::string& where, std::uint64_t largest_size);

/// Wilson's RVL, after its width and height in four bytes each: runs of zeros, and differences in groups of
/// three bits. The same limit. Throws std::runtime_error.
DepthImage read_rvl(std::string_view bytes, std::uint64_t largest_size);

/// True if the header is complete and of a picture other than a 16-bit depth image.
bool is_picture(const std::filesystem::path& file);

/// Of a 16-bit depth image.
inline bool is_reading(std::uint16_t pixel) { return pixel != 0 && pixel != 65535; }
/// REP 118: NaN, ±∞ and, by some drivers, 0 are no readings.
inline bool is_reading(float pixel) { return pixel > 0 && pixel <= std::numeric_limits<float>::max(); }

/// m. What is nearer is no reading: sensors see from some centimetres on, formats count millimetres, and
/// numbers far smaller have no digits left (1.4e-45).
inline constexpr float nearest_depth = 1e-3F;

struct Lens;

/// Points in the camera's frame (x right, y down, z along the optical axis), metres, one per pixel that has a
/// reading of a surface (erase_flying_pixels), on the ray that the lens let through; not finite: there is
/// none. `depth`: m, row by row; 0: no reading.
std::vector<Eigen::Vector3f> back_project(std::vector<float> depth, std::size_t width,
                                          const Intrinsics& camera, const Lens* lens);
/// `scale`: units per metre. `pixel(u, v)`: in units, row by row.
template <class Pixel>
std::vector<Eigen::Vector3f> back_project(std::size_t width, std::size_t height, const Intrinsics& camera,
                                          double scale, const Pixel& pixel, const Lens* lens = nullptr) {
  const auto metres = static_cast<float>(1 / scale);
  std::vector<float> depth(width * height);
  for (std::size_t v = 0; v < height; ++v)
    for (std::size_t u = 0; u < width; ++u) {
      const auto reading = pixel(u, v);
      const float z = is_reading(reading) ? static_cast<float>(reading) * metres : 0.0F;
      depth[v * width + u] = z >= nearest_depth ? z : 0.0F;
    }
  return back_project(std::move(depth), width, camera, lens);
}
std::vector<Eigen::Vector3f> back_project(const DepthImage& image, const Intrinsics& camera, double scale,
                                          const Lens* lens = nullptr);

/// Pixels from a reading on a ramp to the surfaces beside it: an edge blurs over two pixels on each side.
inline constexpr std::ptrdiff_t ramp_width = 4;

/// Sets readings between two surfaces, on neither, to 0: at an edge a ramp a few pixels wide hangs between
/// front and back. Along its row or its column, such a reading is behind the surface on one side and before
/// that on the other, both continued to here from four to eight pixels away, by more than the noise; their
/// inverse depth changes less than across the edge, as a plane's does not. Things of less than four pixels
/// between a nearer and a farther one are lost, too. `depth`: m, row by row; 0: no reading.
void erase_flying_pixels(std::vector<float>& depth, std::size_t width);

}  // namespace octosurf::io
