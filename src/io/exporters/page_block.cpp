#include "io/exporters/page_block.hpp"

#include <array>
#include <limits>
#include <new>
#include <zlib.h>

#include <octosurf/error.hpp>

namespace octosurf::io {

std::string gzip(std::string_view bytes) {
  constexpr int gzip_format = 16;
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + gzip_format, MAX_MEM_LEVEL,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string result;
  std::array<char, 65536> part;
  constexpr std::size_t most = std::numeric_limits<uInt>::max();  // zlib's limit per call
  int state = Z_OK;
  while (state == Z_OK) {
    if (stream.avail_in == 0) {
      const std::string_view next = bytes.substr(0, most);
      bytes.remove_prefix(next.size());
      // zlib only reads it, but older declarations lack the const.
      stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(next.data()));
      stream.avail_in = static_cast<uInt>(next.size());
    }
    stream.next_out = reinterpret_cast<Bytef*>(part.data());
    stream.avail_out = static_cast<uInt>(part.size());
    state = deflate(&stream, bytes.empty() ? Z_FINISH : Z_NO_FLUSH);
    result.append(part.data(), part.size() - stream.avail_out);
  }
  deflateEnd(&stream);
  return result;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string PageBlock::packed() const {
  // Invalid UTF-8 in a name is replaced.
  std::string document = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  document.insert(document.size() - 1, texts_);
  document.resize((document.size() + 3) / 4 * 4, ' ');
  const auto length = static_cast<std::uint32_t>(document.size());
  std::string whole(sizeof length, 0);
  std::memcpy(whole.data(), &length, sizeof length);
  whole += document;
  whole += bytes_;
  return gzip(whole);
}

}  // namespace octosurf::io
