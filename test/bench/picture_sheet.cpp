#include "bench/picture_sheet.hpp"

#include "io/png_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <spng.h>
#include <string>
#if OCTOSURF_HAVE_JPEG
#include <jpeglib.h>
#endif

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw Error(Error::Kind::data, file.string(), why, "name another picture");
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) refuse(file, "cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

Picture decode_png(const std::string& bytes, const std::filesystem::path& file) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(0), &spng_ctx_free);
  spng_ihdr header{};
  std::size_t size = 0;
  if (!context || spng_set_png_buffer(context.get(), bytes.data(), bytes.size()) != 0 ||
      spng_get_ihdr(context.get(), &header) != 0 ||
      spng_decoded_image_size(context.get(), SPNG_FMT_RGB8, &size) != 0)
    refuse(file, "is no PNG");
  Picture picture{static_cast<int>(header.width), static_cast<int>(header.height),
                  std::vector<std::uint8_t>(size)};
  if (spng_decode_image(context.get(), picture.rgb.data(), size, SPNG_FMT_RGB8, 0) != 0)
    refuse(file, "is a damaged PNG");
  return picture;
}

#if OCTOSURF_HAVE_JPEG
Picture decode_jpeg(const std::string& bytes, const std::filesystem::path& file) {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  errors.error_exit = [](j_common_ptr) { throw Error(Error::Kind::data, "picture", "is a damaged JPEG"); };
  errors.output_message = [](j_common_ptr) {};
  jpeg_create_decompress(&jpeg);
  const std::unique_ptr<jpeg_decompress_struct, decltype(&jpeg_destroy_decompress)> held(
      &jpeg, &jpeg_destroy_decompress);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  if (jpeg_read_header(&jpeg, TRUE) != JPEG_HEADER_OK) refuse(file, "is no JPEG");
  jpeg.out_color_space = JCS_RGB;
  jpeg_start_decompress(&jpeg);
  Picture picture{static_cast<int>(jpeg.output_width), static_cast<int>(jpeg.output_height), {}};
  const std::size_t row = std::size_t{3} * jpeg.output_width;
  picture.rgb.resize(row * jpeg.output_height);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW line = picture.rgb.data() + row * jpeg.output_scanline;
    jpeg_read_scanlines(&jpeg, &line, 1);
  }
  return picture;
}
#endif

bool readable(const std::filesystem::path& file) {
  return file.extension() == ".png" || (OCTOSURF_HAVE_JPEG && file.extension() == ".jpg");
}

/// Each pixel of the result is the mean of those it covers, at least of the nearest.
void draw_scaled(const Picture& from, Picture& to, int left, int top, int width, int height) {
  const double scale =
      std::min(static_cast<double>(width) / from.width, static_cast<double>(height) / from.height);
  const int columns = static_cast<int>(from.width * scale), rows = static_cast<int>(from.height * scale);
  const auto begin = [&](int k, int side) { return std::min(side - 1, static_cast<int>(k / scale)); };
  const auto end = [&](int k, int side) { return std::min(side, static_cast<int>((k + 1) / scale)); };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      std::array<int, 3> sum{};
      int count = 0;
      for (int v = begin(y, from.height); v < std::max(begin(y, from.height) + 1, end(y, from.height)); ++v)
        for (int u = begin(x, from.width); u < std::max(begin(x, from.width) + 1, end(x, from.width)); ++u) {
          for (int c = 0; c < 3; ++c)
            sum[static_cast<std::size_t>(c)] +=
                from.rgb[static_cast<std::size_t>(3 * (v * from.width + u) + c)];
          ++count;
        }
      const int at = 3 * ((top + (height - rows) / 2 + y) * to.width + left + (width - columns) / 2 + x);
      for (int c = 0; c < 3; ++c)
        to.rgb[static_cast<std::size_t>(at + c)] =
            static_cast<std::uint8_t>(sum[static_cast<std::size_t>(c)] / count);
    }
}

}  // namespace

Picture read_picture(const std::filesystem::path& file) {
  const std::string bytes = bytes_of(file);
#if OCTOSURF_HAVE_JPEG
  if (file.extension() == ".jpg") return decode_jpeg(bytes, file);
#endif
  return decode_png(bytes, file);
}

std::optional<ColorFrame> color_frame_near(const std::filesystem::path& recording, std::size_t frame) {
  constexpr std::string_view prefix = "frame-";
  std::optional<ColorFrame> nearest;
  const auto away = [&](std::size_t k) { return k > frame ? k - frame : frame - k; };
  for (const char* folder : {"color_reference", "frames", "."}) {
    if (!std::filesystem::is_directory(recording / folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(recording / folder)) {
      const std::string name = entry.path().stem().string();
      if (!name.starts_with(prefix) || !name.ends_with(".color") || !readable(entry.path())) continue;
      ColorFrame found{0, entry.path()};
      const char* const digits = name.data() + prefix.size();
      if (std::from_chars(digits, name.data() + name.size(), found.frame).ptr == digits) continue;
      if (!nearest || away(found.frame) < away(nearest->frame)) nearest = found;
    }
  }
  return nearest;
}

Picture sheet_of(const std::vector<Picture>& pictures, int width, int height) {
  const int rows = static_cast<int>((pictures.size() + 1) / 2);
  Picture sheet{2 * width, rows * height, {}};
  sheet.rgb.assign(static_cast<std::size_t>(3 * sheet.width * sheet.height), 255);
  for (std::size_t k = 0; k < pictures.size(); ++k)
    draw_scaled(pictures[k], sheet, static_cast<int>(k % 2) * width, static_cast<int>(k / 2) * height, width,
                height);
  return sheet;
}

void write_picture(const Picture& picture, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  io::write_png(picture.rgb, picture.width, picture.height, out);
  if (!out.flush()) throw Error(Error::Kind::output, file.string(), "cannot be written", "check the folder");
}

}  // namespace octosurf::bench
