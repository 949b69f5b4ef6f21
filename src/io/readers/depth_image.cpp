#include "io/readers/depth_image.hpp"

#include "io/readers/bounded_file.hpp"
#include "io/readers/lens.hpp"
#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <spng.h>
#include <string>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::size_t largest_file = std::size_t{512} << 20;
// Memory per pixel, in the image and as a point: a PNG's may take 64 MiB (4.7 million pixels) and seven times
// its size.
constexpr std::size_t pixel_cost = 2 + sizeof(Eigen::Vector3f), image_free_bytes = std::size_t{64} << 20;
constexpr std::size_t bytes_per_file_byte = 7;
constexpr std::string_view pgm_blanks = " \t\r\n\v\f";
constexpr std::string_view png_signature = "\x89PNG\r\n\x1a\n";

[[noreturn]] void refuse_image(const std::filesystem::path& file, const std::string& what,
                               const std::string& hint = "depth images are 16-bit gray PNG or PGM") {
  throw Error(Error::Kind::data, file.string(), what, hint);
}

void check_size(std::uint64_t width, std::uint64_t height, const std::filesystem::path& file) {
  if (width == 0 || height == 0 || width > largest_side || height > largest_side)
    refuse_image(file, "an image of " + size_text(width, height) + " pixels");
}

DepthImage decode_png(std::string_view bytes, const std::filesystem::path& file, std::uint64_t largest_size) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), &spng_ctx_free);
  if (!context) throw std::bad_alloc();
  spng_set_image_limits(context.get(), largest_side, largest_side);
  spng_set_chunk_limits(context.get(), largest_file, largest_file);
  spng_ihdr header{};
  if (spng_set_png_buffer(context.get(), bytes.data(), bytes.size()) != 0 ||
      spng_get_ihdr(context.get(), &header) != 0)
    refuse_image(file, "damaged PNG header");
  if (header.bit_depth != 16 || header.color_type != SPNG_COLOR_TYPE_GRAYSCALE)
    refuse_image(file, "a PNG of " + std::to_string(header.bit_depth) + " bits" +
                           (header.color_type == SPNG_COLOR_TYPE_GRAYSCALE ? "" : " in colour"));
  check_size(header.width, header.height, file);
  DepthImage image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  const std::size_t pixels = std::size_t{header.width} * header.height;
  if (pixel_cost * pixels > largest_size)
    refuse_image(file, "truncated PNG: " + size_text(header.width, header.height) + " pixels in " +
                           std::to_string(bytes.size()) + " bytes");
  image.pixels.resize(pixels);
  int error = spng_decode_image(context.get(), image.pixels.data(), 2 * pixels, SPNG_FMT_PNG, 0);
  if (error == 0) error = spng_decode_chunks(context.get());  // to the end: verifies checksums
  if (error != 0) refuse_image(file, std::string("truncated or damaged PNG (") + spng_strerror(error) + ")");
  return image;
}

/// Removes and returns the number at the front, behind blanks and `#` comments, of a PGM's header.
std::optional<std::uint32_t> pgm_number(std::string_view& text) {
  const auto skip_to = [&](std::size_t place) { text.remove_prefix(std::min(place, text.size())); };
  for (skip_to(text.find_first_not_of(pgm_blanks)); text.starts_with('#');
       skip_to(text.find_first_not_of(pgm_blanks)))
    skip_to(text.find('\n'));
  std::uint32_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  skip_to(static_cast<std::size_t>(stop - text.data()));
  return value;
}

DepthImage decode_pgm(const std::string& bytes, const std::filesystem::path& file) {
  std::string_view text = std::string_view(bytes).substr(2);  // after the magic number
  const auto width = pgm_number(text), height = pgm_number(text), maximum = pgm_number(text);
  if (!width || !height || !maximum || *maximum > 65535)
    refuse_image(file, "truncated or damaged PGM header");
  if (*maximum <= 255) refuse_image(file, "a PGM of 8 bits");
  check_size(*width, *height, file);
  const std::size_t pixels = std::size_t{*width} * *height;
  const std::size_t first = bytes.size() - text.size() + 1;  // one whitespace ends the header
  if (bytes.size() < first || bytes.size() - first < 2 * pixels) refuse_image(file, "truncated PGM");
  DepthImage image{static_cast<int>(*width), static_cast<int>(*height), {}};
  image.pixels.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    image.pixels[i] = number_at<std::uint16_t>(bytes.data() + first + 2 * i, little_endian_host);
  return image;
}

}  // namespace

std::string size_text(std::uint64_t width, std::uint64_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

Intrinsics read_intrinsics(const std::filesystem::path& file) {
  std::vector<double> v;
  for (const auto& line : read_text(file)) {
    const auto values = numbers(line, file);
    v.insert(v.end(), values.begin(), values.end());
  }
  return intrinsics_of(std::move(v), file.string());
}

Intrinsics intrinsics_of(std::vector<double> v, const std::string& where) {
  constexpr const char* hint = "give a 3x3 K or 'fx fy cx cy' in pixels";
  if (v.size() != 4 && v.size() != 9)
    refuse_image(where, std::to_string(v.size()) + " numbers are no camera intrinsics", hint);
  if (v.size() == 9) {
    if (v[1] != 0 || v[3] != 0 || v[6] != 0 || v[7] != 0 || v[8] != 1)
      refuse_image(where, "not a matrix fx 0 cx / 0 fy cy / 0 0 1", hint);
    v = {v[0], v[4], v[2], v[5]};
  }
  if (!std::ranges::all_of(v, [](double value) { return std::isfinite(value); }) || v[0] == 0 || v[1] == 0)
    refuse_image(where, "a focal length is zero or not finite", hint);
  return {v[0], v[1], v[2], v[3]};
}

void require_same_size(const Intrinsics& camera, int width, int height, const std::string& where) {
  if (width < 2 || height < 2) return;                                                      // no middle
  const double across = 2 * camera.cx / (width - 1), along = 2 * camera.cy / (height - 1);  // 1: the middle
  const auto off = [](double side) { return side > 1.5 || (side > 0 && side < 1 / 1.5); };
  // An image's part has its middle elsewhere, but hardly so that both sides agree to a tenth.
  const bool scaled = off(across) && off(along) && std::abs(across / along - 1) < 0.1;
  const auto inside = [](double side) { return side >= 0 && side <= 2; };
  if (!scaled && inside(across) && inside(along)) return;
  std::string hint = "give --intrinsics of these images";
  if (scaled)
    hint += formatted(": fx fy cx cy times %.3g",
                      (width / (2 * camera.cx + 1) + height / (2 * camera.cy + 1)) / 2);
  throw Error(
      Error::Kind::data, where,
      formatted(
          "the intrinsics' principal point %g %g is that of images of about %.0fx%.0f pixels, not of %dx%d",
          camera.cx, camera.cy, 2 * camera.cx + 1, 2 * camera.cy + 1, width, height),
      hint);
}

DepthImage read_depth_image(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file, largest_file);
  if (bytes.empty()) refuse_image(file, "is empty");
  if (bytes.starts_with(png_signature))
    return decode_png(bytes, file, image_free_bytes + bytes_per_file_byte * bytes.size());
  if (bytes.starts_with("P5")) return decode_pgm(bytes, file);
  refuse_image(file, "neither PNG nor PGM");
}

DepthImage read_png(std::string_view bytes, const std::string& where, std::uint64_t largest_size) {
  if (!bytes.starts_with(png_signature)) refuse_image(where, "not a PNG");
  return decode_png(bytes, where, largest_size);
}

DepthImage read_rvl(std::string_view bytes, std::uint64_t largest_size) {
  RecordBytes stream(bytes);
  const std::uint32_t width = stream.u32(), height = stream.u32();
  if (width == 0 || height == 0 || width > largest_side || height > largest_side ||
      pixel_cost * width * height > largest_size)
    fail_reading("an image of " + size_text(width, height) + " pixels");
  // Numbers of nibbles, the high ones of each little-endian word first: three bits each, the lowest first,
  // and one that says whether more follow.
  std::uint32_t word = 0;
  int nibbles = 0;
  const auto number = [&] {
    std::uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 3) {
      if (nibbles == 0) {
        word = stream.u32();
        nibbles = 8;
      }
      const std::uint32_t nibble = word >> 28;
      word <<= 4;
      --nibbles;
      value |= (nibble & 7) << shift;
      if ((nibble & 8) == 0) return value;
    }
    fail_reading("damaged RVL");
  };
  DepthImage image{static_cast<int>(width), static_cast<int>(height), {}};
  image.pixels.resize(std::size_t{width} * height);
  std::uint16_t last = 0;
  for (std::size_t i = 0; i < image.pixels.size();) {
    const std::size_t zeros = number(), others = number();
    if (zeros + others > image.pixels.size() - i || zeros + others == 0) fail_reading("damaged RVL");
    i += zeros;
    for (const std::size_t end = i + others; i < end; ++i) {
      const std::uint32_t step = number();
      last = static_cast<std::uint16_t>(last + (step >> 1 ^ (0U - (step & 1))));
      image.pixels[i] = last;
    }
  }
  return image;
}

bool is_picture(const std::filesystem::path& file) {
  std::string head(256, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  // IHDR is a PNG's first chunk: bit depth is byte 24, colour type byte 25 (0 is gray).
  if (head.starts_with(png_signature)) return head.size() > 25 && (head[24] != 16 || head[25] != 0);
  if (!head.starts_with("P5")) return false;
  std::string_view text = std::string_view(head).substr(2);
  pgm_number(text);  // width
  pgm_number(text);
  const auto maximum = pgm_number(text);
  return maximum && *maximum <= 255;
}

namespace {

/// m: a smaller offset stays within a voxel.
constexpr float least_offset = 0.01F;

/// 1/m, times depth²: four standard deviations of a depth camera (1.5 mm at 1 m; Khoshelham and Elberink
/// 2012).
constexpr float noise = 4 * 0.0015F;

/// Whether `at[0]` lies clearly between the readings `near` before and after. Without branches, so that
/// compilers compute several at once: hardly any does.
unsigned between(const float* at, std::ptrdiff_t near) {
  const float z = at[0], before = at[-near], after = at[near];
  const float offset = std::max(least_offset, noise * z * z);
  return static_cast<unsigned>(std::min(before, after) < z - offset) &
         static_cast<unsigned>(std::max(before, after) > z + offset);
}

/// Whether `at[0]` is on a ramp; its neighbours are `step` apart. at[±2 · ramp_width · step] must be there.
bool flies(const float* at, std::ptrdiff_t step) {
  const std::ptrdiff_t near = ramp_width * step;
  if (between(at, near) == 0) return false;
  const float z = at[0], before = at[-near], after = at[near];
  const float offset = std::max(least_offset, noise * z * z);
  const float beyond_before = at[-2 * near], beyond_after = at[2 * near];
  if (!(std::min({z, before, after, beyond_before, beyond_after}) > 0)) return false;
  // Inverse depths: on a plane they change by the same from place to place.
  const float change = 1 / after - 1 / before;
  const float change_before = 1 / before - 1 / beyond_before, change_after = 1 / beyond_after - 1 / after;
  if (std::max(std::fabs(change_before), std::fabs(change_after)) > std::fabs(change) / 4) return false;
  // Where the two surfaces would be seen here.
  const float first = 1 / (1 / before + change_before), second = 1 / (1 / after - change_after);
  return std::min(first, second) < z - offset && std::max(first, second) > z + offset;
}

/// Adds those of [begin, end) on a ramp.
void add_flying(const std::vector<float>& depth, std::size_t begin, std::size_t end, std::ptrdiff_t step,
                std::vector<std::size_t>& flying) {
  constexpr std::size_t together = 32;
  for (std::size_t first = begin; first < end; first += together) {
    const std::size_t last = std::min(first + together, end);
    unsigned any = 0;
    for (std::size_t i = first; i < last; ++i) any |= between(&depth[i], ramp_width * step);
    if (any == 0) continue;
    for (std::size_t i = first; i < last; ++i)
      if (flies(&depth[i], step)) flying.push_back(i);
  }
}

}  // namespace

void erase_flying_pixels(std::vector<float>& depth, std::size_t width) {
  constexpr auto margin = static_cast<std::size_t>(2 * ramp_width);
  const std::size_t height = width == 0 ? 0 : depth.size() / width;
  std::vector<std::size_t> flying;
  if (width > 2 * margin)
    for (std::size_t v = 0; v < height; ++v)
      add_flying(depth, v * width + margin, (v + 1) * width - margin, 1, flying);
  if (height > 2 * margin)
    add_flying(depth, margin * width, (height - margin) * width, static_cast<std::ptrdiff_t>(width), flying);
  for (const std::size_t i : flying) depth[i] = 0;
}

std::vector<Eigen::Vector3f> back_project(std::vector<float> depth, std::size_t width,
                                          const Intrinsics& camera, const Lens* lens) {
  erase_flying_pixels(depth, width);
  std::vector<Eigen::Vector3f> points(depth.size());
  std::size_t count = 0;
  const auto place = [&](float slope_x, float slope_y, float z) {
    // Written always and kept only for valid readings: no branch to mispredict.
    points[count] = {slope_x * z, slope_y * z, z};
    count += z > 0;
  };
  if (lens != nullptr && is_known(*lens) && !depth.empty()) {
    const auto slopes = slopes_of(camera, *lens, width, depth.size() / width);
    for (std::size_t i = 0; i < depth.size(); ++i) place((*slopes)[i].x(), (*slopes)[i].y(), depth[i]);
  } else {
    std::vector<float> slope_x(width);
    for (std::size_t u = 0; u < width; ++u)
      slope_x[u] = static_cast<float>((static_cast<double>(u) - camera.cx) / camera.fx);
    for (std::size_t i = 0, v = 0; i < depth.size(); ++v) {
      const auto slope_y = static_cast<float>((static_cast<double>(v) - camera.cy) / camera.fy);
      for (std::size_t u = 0; u < width; ++u, ++i) place(slope_x[u], slope_y, depth[i]);
    }
  }
  points.resize(count);
  return points;
}

std::vector<Eigen::Vector3f> back_project(const DepthImage& image, const Intrinsics& camera, double scale,
                                          const Lens* lens) {
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  const auto pixel = [&](std::size_t u, std::size_t v) { return image.pixels[v * width + u]; };
  if (image.quant_a == 0) return back_project(width, height, camera, scale, pixel, lens);
  const auto metres = [&](std::size_t u, std::size_t v) {
    const std::uint16_t p = pixel(u, v);
    return p == 0 ? 0.0F : image.quant_a / (static_cast<float>(p) - image.quant_b);
  };
  return back_project(width, height, camera, scale, metres, lens);
}

}  // namespace octosurf::io
