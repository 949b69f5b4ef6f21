#include "io/readers/bounded_file.hpp"

#include <bzlib.h>
#include <limits>
#include <lz4frame.h>
#include <memory>
#include <zstd.h>

namespace octosurf::io {
namespace {

void unpack_zstd(std::string_view block, std::string& plain) {
  const std::size_t size = ZSTD_decompress(plain.data(), plain.size(), block.data(), block.size());
  if (ZSTD_isError(size)) fail_reading(std::string("zstd says ") + ZSTD_getErrorName(size));
  if (size != plain.size()) fail_reading("zstd gives fewer bytes than announced");
}

void unpack_lz4(std::string_view block, std::string& plain) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      raw, &LZ4F_freeDecompressionContext);
  std::size_t read = 0, written = 0, hint = 1;
  while (hint != 0) {  // 0: the frame is complete with a correct checksum
    std::size_t in = block.size() - read, out = plain.size() - written;
    hint = LZ4F_decompress(raw, plain.data() + written, &out, block.data() + read, &in, nullptr);
    if (LZ4F_isError(hint)) fail_reading(std::string("lz4 says ") + LZ4F_getErrorName(hint));
    if (hint != 0 && in == 0 && out == 0)
      fail_reading("an lz4 frame that is cut off or larger than announced");
    read += in;
    written += out;
  }
  if (written != plain.size() || read != block.size())
    fail_reading("an lz4 frame of another size than announced");
}

void unpack_bz2(std::string_view block, std::string& plain) {
  if (block.size() > std::numeric_limits<unsigned>::max() ||
      plain.size() > std::numeric_limits<unsigned>::max())
    fail_reading("a bz2 block of over 4 GB");
  auto size = static_cast<unsigned>(plain.size());
  // The C interface lacks const; the input is not written to.
  const int error = BZ2_bzBuffToBuffDecompress(plain.data(), &size, const_cast<char*>(block.data()),
                                               static_cast<unsigned>(block.size()), 0, 0);
  if (error == BZ_MEM_ERROR) throw std::bad_alloc();
  if (error != BZ_OK || size != plain.size()) fail_reading("damaged bz2 (" + std::to_string(error) + ")");
}

}  // namespace

BoundedFile::BoundedFile(const std::filesystem::path& file) : path_(file), stream_(file, std::ios::binary) {
  std::error_code error;
  size_ = std::filesystem::file_size(file, error);
  if (!stream_ || error) throw Error(Error::Kind::data, file.string(), "cannot be read");
}

void BoundedFile::refuse(const std::string& what, const std::string& hint) const {
  throw Error(Error::Kind::data, path_.string(), what + " at byte " + std::to_string(position_), hint);
}

void BoundedFile::require(std::uint64_t bytes) const {
  if (bytes > left())
    refuse("truncated: a record of " + std::to_string(bytes) + " bytes begins, " + std::to_string(left()) +
               " are left",
           "copy the file again; --skip-bad maps what is whole");
}

void BoundedFile::seek(std::uint64_t position) {
  stream_.clear();
  stream_.seekg(static_cast<std::streamoff>(position));
  position_ = position;
}

std::string BoundedFile::take(std::uint64_t bytes) {
  require(bytes);
  std::string taken(bytes, '\0');
  stream_.read(taken.data(), static_cast<std::streamsize>(bytes));
  if (static_cast<std::uint64_t>(stream_.gcount()) != bytes) refuse("cannot be read");
  position_ += bytes;
  return taken;
}

void BoundedFile::skip(std::uint64_t bytes) {
  require(bytes);
  seek(position_ + bytes);
}

std::uint64_t RecordBytes::number(std::size_t width, bool big_endian) {
  const std::string_view bytes = take(width);
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < width; ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[big_endian ? i : width - 1 - i]);
  return value;
}

std::string_view RecordBytes::take(std::uint64_t size) {
  if (size > bytes_.size() - position_) fail_reading("ends too early");
  const std::string_view taken = bytes_.substr(position_, size);
  position_ += size;
  return taken;
}

std::string decompressed(std::string_view block, std::string_view format, std::uint64_t size) {
  if (format.empty() || format == "none") {
    if (size != block.size()) fail_reading("a block of another size than announced");
    return std::string(block);
  }
  std::string plain(size, '\0');
  if (format == "zstd")
    unpack_zstd(block, plain);
  else if (format == "lz4")
    unpack_lz4(block, plain);
  else if (format == "bz2")
    unpack_bz2(block, plain);
  else
    fail_reading("compressed as '" + std::string(format.substr(0, 20)) + "', which is not read");
  return plain;
}

std::string decompressed(std::string_view zstd_frame) {
  const std::uint64_t size = ZSTD_getFrameContentSize(zstd_frame.data(), zstd_frame.size());
  if (size > largest_scan(zstd_frame.size())) fail_reading("zstd says no size, or far more than is packed");
  return decompressed(zstd_frame, "zstd", size);
}

}  // namespace octosurf::io
