#include "io/png_file.hpp"

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <spng.h>

#include <octosurf/error.hpp>

namespace octosurf::io {

void write_png(const std::vector<std::uint8_t>& rgb, int width, int height, std::ostream& out) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> context(spng_ctx_new(SPNG_CTX_ENCODER),
                                                                    &spng_ctx_free);
  if (!context) throw std::bad_alloc();
  const auto require = [](int status) {
    if (status != 0) throw Error(Error::Kind::output, "picture", spng_strerror(status));
  };
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = 8;
  header.color_type = SPNG_COLOR_TYPE_TRUECOLOR;
  require(spng_set_option(context.get(), SPNG_ENCODE_TO_BUFFER, 1));
  require(spng_set_ihdr(context.get(), &header));
  require(spng_encode_image(context.get(), rgb.data(), rgb.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  std::size_t size = 0;
  int status = 0;
  const std::unique_ptr<void, decltype(&std::free)> png(spng_get_png_buffer(context.get(), &size, &status),
                                                        &std::free);
  require(status);
  out.write(static_cast<const char*>(png.get()), static_cast<std::streamsize>(size));
}

}  // namespace octosurf::io
