#include "io/exporters/page_block.hpp"

#include <array>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
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
  using namespace boost::archive::iterators;
  using Digits = base64_from_binary<transform_width<const char*, 6, 8>>;
  std::string text(Digits(bytes.data()), Digits(bytes.data() + bytes.size()));
  return text.append((4 - text.size() % 4) % 4, '=');
}

std::string PageBlock::document() const {
  // Invalid UTF-8 in a name is replaced.
  std::string document = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return document.insert(document.size() - 1, texts_);
}

std::string PageBlock::packed() const {
  std::string document = this->document();
  document.resize((document.size() + 3) / 4 * 4, ' ');
  const auto length = static_cast<std::uint32_t>(document.size());
  std::string whole(sizeof length, 0);
  std::memcpy(whole.data(), &length, sizeof length);
  whole += document;
  whole += bytes_;
  return gzip(whole);
}

}  // namespace octosurf::io
