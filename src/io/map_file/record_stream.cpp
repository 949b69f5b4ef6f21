#include "io/map_file/record_stream.hpp"

#include "io/text_file.hpp"

#include <algorithm>

namespace octosurf::io {
namespace {

constexpr int compression_level = 3;
constexpr int largest_window = 23;  // log2 of bytes; level 3 takes 21, a decoder would accept 27
constexpr std::size_t growth = std::size_t{1} << 20;
constexpr std::string_view skippable_magic{"\x50\x2a\x4d\x18", 4};  // zstd's
constexpr std::uint64_t most_zeros = 0xffffffff;

}  // namespace

RecordWriter::RecordWriter(std::ostream& out) : out_(out) {
  if (!context_) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, compression_level);
}

void RecordWriter::compress(std::string_view bytes, ZSTD_EndDirective mode) {
  ZSTD_inBuffer input{bytes.data(), bytes.size(), 0};
  for (;;) {
    ZSTD_outBuffer output{buffer_.data(), buffer_.size(), 0};
    const std::size_t left = ZSTD_compressStream2(context_.get(), &output, &input, mode);
    if (ZSTD_isError(left)) throw Error(Error::Kind::output, "zstd", ZSTD_getErrorName(left));
    write({buffer_.data(), output.pos});
    if (mode == ZSTD_e_continue ? input.pos == input.size : left == 0) return;
  }
}

void RecordWriter::write(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  written_ += bytes.size();
}

void RecordWriter::take(std::string_view bytes) {
  crc_ = crc32_of(bytes, crc_);
  taken_ += bytes.size();
  compress(bytes, ZSTD_e_continue);
}

void RecordWriter::put(std::string_view record) {
  if (record.size() > record_limit)
    throw Error(Error::Kind::output, "map file",
                "a record of " + std::to_string(record.size()) + " bytes is over the format's limit",
                "map with a larger max_hole_size or resolution");
  std::string length;
  std::size_t rest = record.size();
  for (; rest >= 128; rest >>= 7) length.push_back(static_cast<char>(rest | 128));
  length.push_back(static_cast<char>(rest));
  take(length);
  take(record);
  ++records_;
}

void RecordWriter::finish(std::uint64_t least_bytes) {
  compress({}, ZSTD_e_end);
  if (written_ >= least_bytes) return;
  std::uint64_t zeros = std::min(least_bytes - written_, most_zeros);
  std::string head(skippable_magic);
  for (int shift = 0; shift < 32; shift += 8) head.push_back(static_cast<char>(zeros >> shift & 0xff));
  write(head);
  const std::string some(growth, '\0');
  for (; zeros > 0; zeros -= std::min<std::uint64_t>(zeros, some.size()))
    write(std::string_view(some).substr(0, zeros));
}

RecordReader::RecordReader(std::istream& in, std::uint64_t budget, std::string name)
    : Damage{std::move(name), {}}, in_(in), budget_(budget) {
  if (!context_) throw std::bad_alloc();
  ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, largest_window);
}

bool RecordReader::refill() {
  while (position_ == output_.pos) {
    if (ended_) return false;
    output_ = {plain_.data(), plain_.size(), 0};
    position_ = 0;
    // Before reading on: the decoder may still have output.
    const std::size_t left = ZSTD_decompressStream(context_.get(), &output_, &input_);
    if (ZSTD_isError(left)) fail(std::string("zstd says ") + ZSTD_getErrorName(left));
    if (output_.pos > budget_) fail("it decompresses to far more than its size allows");
    budget_ -= output_.pos;
    if (left == 0)
      end_frame();
    else if (output_.pos == 0 && input_.pos == input_.size)
      read_more();
  }
  return true;
}

void RecordReader::read_more() {
  in_.read(packed_.data(), static_cast<std::streamsize>(packed_.size()));
  input_ = {packed_.data(), static_cast<std::size_t>(in_.gcount()), 0};
  if (input_.size == 0) fail("it ends too early");
}

void RecordReader::end_frame() {
  ended_ = true;
  if (!has_packed()) return;
  for (const char byte : skippable_magic)
    if (next_packed() != static_cast<unsigned char>(byte)) fail("bytes are left over");
  std::uint64_t zeros = 0;
  for (int shift = 0; shift < 32; shift += 8) zeros |= std::uint64_t{next_packed()} << shift;
  for (; zeros > 0; --zeros)
    if (next_packed() != 0) fail("bytes are left over");
  if (has_packed()) fail("bytes are left over");
}

unsigned char RecordReader::next_packed() {
  if (input_.pos == input_.size) read_more();
  return static_cast<const unsigned char*>(input_.src)[input_.pos++];
}

std::string_view RecordReader::take(std::size_t most) {
  const std::string_view bytes(plain_.data() + position_, std::min(most, output_.pos - position_));
  position_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
  return bytes;
}

std::optional<std::size_t> RecordReader::read_length() {
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

bool RecordReader::next(std::string& record) {
  record.clear();
  crc_before_last_ = crc_;
  const std::optional<std::size_t> length = read_length();
  if (!length) return false;
  record.reserve(std::min(*length, growth));
  while (record.size() < *length) {
    if (!refill()) fail("it ends within a record");
    record += take(*length - record.size());
  }
  ++records_;
  return true;
}

}  // namespace octosurf::io
