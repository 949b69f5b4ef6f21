#include "io/map_file/record_stream.hpp"

#include <algorithm>
#include <optional>
#include <vector>
#include <zlib.h>
#include <zstd.h>

namespace octosurf::io {
namespace {

constexpr int compression_level = 3;
constexpr int largest_window = 23;  // log2 of bytes; level 3 takes 21, a decoder would accept 27
constexpr std::size_t growth = std::size_t{1} << 20;
constexpr std::string_view skippable_magic{"\x50\x2a\x4d\x18", 4};  // zstd's
constexpr std::uint64_t most_zeros = 0xffffffff;

/// Continues the checksum `crc` with further bytes.
std::uint32_t crc_of(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      ::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

struct RecordWriter::Impl {
  explicit Impl(std::ostream& stream) : out(stream), context(ZSTD_createCCtx(), &ZSTD_freeCCtx) {
    if (!context) throw std::bad_alloc();
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, compression_level);
  }

  void compress(std::string_view bytes, ZSTD_EndDirective mode) {
    ZSTD_inBuffer input{bytes.data(), bytes.size(), 0};
    for (;;) {
      ZSTD_outBuffer output{buffer.data(), buffer.size(), 0};
      const std::size_t left = ZSTD_compressStream2(context.get(), &output, &input, mode);
      if (ZSTD_isError(left)) throw Error(Error::Kind::output, "zstd", ZSTD_getErrorName(left));
      write({buffer.data(), output.pos});
      if (mode == ZSTD_e_continue ? input.pos == input.size : left == 0) return;
    }
  }

  void write(std::string_view bytes) {
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    written += bytes.size();
  }

  void put(std::string_view bytes) {
    crc = crc_of(crc, bytes);
    taken += bytes.size();
    compress(bytes, ZSTD_e_continue);
  }

  std::ostream& out;
  std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context;
  std::vector<char> buffer = std::vector<char>(ZSTD_CStreamOutSize());
  std::uint32_t crc = 0;
  std::uint64_t records = 0, taken = 0, written = 0;
};

RecordWriter::RecordWriter(std::ostream& out) : impl_(std::make_unique<Impl>(out)) {}
RecordWriter::~RecordWriter() = default;

void RecordWriter::put(std::string_view record) {
  if (record.size() > record_limit)
    throw Error(Error::Kind::output, "map file",
                "a record of " + std::to_string(record.size()) + " bytes is over the format's limit",
                "map with a larger max_hole_size or resolution");
  std::string length;
  std::size_t rest = record.size();
  for (; rest >= 128; rest >>= 7) length.push_back(static_cast<char>(rest | 128));
  length.push_back(static_cast<char>(rest));
  impl_->put(length);
  impl_->put(record);
  ++impl_->records;
}

void RecordWriter::end_block() { impl_->compress({}, ZSTD_e_flush); }
void RecordWriter::finish(std::uint64_t least_bytes) {
  impl_->compress({}, ZSTD_e_end);
  if (impl_->written >= least_bytes) return;
  std::uint64_t zeros = std::min(least_bytes - impl_->written, most_zeros);
  std::string head(skippable_magic);
  for (int shift = 0; shift < 32; shift += 8) head.push_back(static_cast<char>(zeros >> shift & 0xff));
  impl_->write(head);
  const std::string some(growth, '\0');
  for (; zeros > 0; zeros -= std::min<std::uint64_t>(zeros, some.size()))
    impl_->write(std::string_view(some).substr(0, zeros));
}
std::uint64_t RecordWriter::bytes() const { return impl_->taken; }
std::uint64_t RecordWriter::records() const { return impl_->records; }
std::uint32_t RecordWriter::crc32() const { return impl_->crc; }

struct RecordReader::Impl : Damage {
  Impl(std::istream& stream, std::uint64_t most, std::string name)
      : Damage{std::move(name), {}}, in(stream), budget(most), context(ZSTD_createDCtx(), &ZSTD_freeDCtx) {
    if (!context) throw std::bad_alloc();
    ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, largest_window);
  }

  /// Decompresses until a byte is available; false at the end of the frame.
  bool refill() {
    while (position == plain.pos) {
      if (ended) return false;
      plain = {plain_buffer.data(), plain_buffer.size(), 0};
      position = 0;
      // Before reading on: the decoder may still have output.
      const std::size_t left = ZSTD_decompressStream(context.get(), &plain, &input);
      if (ZSTD_isError(left)) fail(std::string("zstd says ") + ZSTD_getErrorName(left));
      if (plain.pos > budget) fail("it decompresses to far more than its size allows");
      budget -= plain.pos;
      if (left == 0)
        end_frame();
      else if (plain.pos == 0 && input.pos == input.size)
        read_more();
    }
    return true;
  }

  void read_more() {
    in.read(packed_buffer.data(), static_cast<std::streamsize>(packed_buffer.size()));
    input = {packed_buffer.data(), static_cast<std::size_t>(in.gcount()), 0};
    if (input.size == 0) fail("it ends too early");
  }

  void end_frame() {
    ended = true;
    if (!has_packed()) return;
    for (const char byte : skippable_magic)
      if (next_packed() != static_cast<unsigned char>(byte)) fail("bytes are left over");
    std::uint64_t zeros = 0;
    for (int shift = 0; shift < 32; shift += 8) zeros |= std::uint64_t{next_packed()} << shift;
    for (; zeros > 0; --zeros)
      if (next_packed() != 0) fail("bytes are left over");
    if (has_packed()) fail("bytes are left over");
  }

  bool has_packed() { return input.pos != input.size || in.peek() != std::istream::traits_type::eof(); }
  unsigned char next_packed() {
    if (input.pos == input.size) read_more();
    return static_cast<const unsigned char*>(input.src)[input.pos++];
  }

  /// Up to `most` available bytes; call refill() first.
  std::string_view take(std::size_t most) {
    const std::size_t n = std::min(most, plain.pos - position);
    const std::string_view bytes(plain_buffer.data() + position, n);
    position += n;
    crc = crc_of(crc, bytes);
    return bytes;
  }

  std::optional<std::size_t> read_length() {
    std::size_t length = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      if (!refill()) {
        if (shift == 0) return {};
        fail("it ends within a length");
      }
      const auto byte = static_cast<unsigned char>(take(1).front());
      length |= static_cast<std::size_t>(byte & 127) << shift;
      if (byte < 128) {
        if (length > record_limit) fail("a record is over the limit");
        return length;
      }
    }
    fail("a length has no end");
  }

  std::istream& in;
  std::uint64_t budget;
  std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context;
  std::vector<char> packed_buffer = std::vector<char>(ZSTD_DStreamInSize());
  std::vector<char> plain_buffer = std::vector<char>(ZSTD_DStreamOutSize());
  ZSTD_inBuffer input{packed_buffer.data(), 0, 0};
  ZSTD_outBuffer plain{plain_buffer.data(), plain_buffer.size(), 0};
  std::size_t position = 0;  // in `plain`
  bool ended = false;
  std::uint32_t crc = 0;
  std::uint32_t crc_before_last = 0;
  std::uint64_t records = 0;
};

RecordReader::RecordReader(std::istream& in, std::uint64_t budget, std::string where)
    : impl_(std::make_unique<Impl>(in, budget, std::move(where))) {}
RecordReader::~RecordReader() = default;

bool RecordReader::next(std::string& record) {
  record.clear();
  impl_->crc_before_last = impl_->crc;
  const std::optional<std::size_t> length = impl_->read_length();
  if (!length) return false;
  record.reserve(std::min(*length, growth));
  while (record.size() < *length) {
    if (!impl_->refill()) impl_->fail("it ends within a record");
    record += impl_->take(*length - record.size());
  }
  ++impl_->records;
  return true;
}

std::uint64_t RecordReader::records() const { return impl_->records; }
std::uint32_t RecordReader::crc32_before_last() const { return impl_->crc_before_last; }

}  // namespace octosurf::io
