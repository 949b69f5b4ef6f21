#include "io/png_file.hpp"

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <spng.h>

#include <octosurf/error.hpp>

namespace octosurf::io {

namespace {

struct PngFormat {
  std::uint8_t bit_depth, color_type;
};

void encode(const void* pixels, std::size_t bytes, int width, int height, PngFormat format,
            std::ostream& out) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER),
                                                                    &spng_ctx_free);
  if (!context) throw std::bad_alloc();
  const auto require = [](int status) {
    if (status != 0) throw Error(Error::Kind::output, "picture", spng_strerror(status));
  };
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = format.bit_depth;
  header.color_type = format.color_type;
  require(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1));
  require(spng_set_ihdr(context.get(), &header));
  require(spng_encode_image(context.get(), pixels, bytes, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, decltype(&std::free)> png(spng_get_png_buffer(context.get(), &size, &status),
                                                        &std::free);
  require(status);
  out.write(static_cast<const char*>(png.get()), static_cast<std::streamsize>(size));
}

}  // namespace

void write_png(const std::vector<std::uint8_t>& rgb, int width, int height, std::ostream& out) {
  encode(rgb.data(), rgb.size(), width, height, {8, SPNG_COLOR_TYPE_TRUECOLOR}, out);
}
void write_png(const std::vector<std::uint16_t>& grey, int width, int height, std::ostream& out) {
  encode(grey.data(), 2 * grey.size(), width, height, {16, SPNG_COLOR_TYPE_GRAYSCALE}, out);
}

}  // namespace octosurf::io
