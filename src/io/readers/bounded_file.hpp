#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include <octosurf/error.hpp>

namespace octosurf::io {

/// Reports damage within a file; the file's reader adds name and position.
[[noreturn]] inline void fail_reading(const std::string& what) { throw std::runtime_error(what); }

/// Calls `work`; `error` converts exceptions about damage that are no Error yet.
template <class Work, class MakeError>
auto with_place(const Work& work, const MakeError& error) -> decltype(work()) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& damage) {
    throw error(std::string(damage.what()));
  }
}

/// A file of length-prefixed records: never reads beyond its end, and never allocates for missing data.
class BoundedFile {
 public:
  /// Throws Error(data) if it cannot be read.
  explicit BoundedFile(const std::filesystem::path& file);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }
  std::uint64_t left() const { return size_ - position_; }
  void seek(std::uint64_t position);

  /// The next bytes; throws Error(data) "truncated" if there are fewer.
  std::string take(std::uint64_t bytes);
  void skip(std::uint64_t bytes);

  /// Throws Error(data) naming the file and the current byte position.
  [[noreturn]] void refuse(const std::string& what, const std::string& hint = {}) const;

 private:
  void require(std::uint64_t bytes) const;

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, position_ = 0;
};

constexpr bool little_endian_host = std::endian::native == std::endian::little;

/// Reads a value at an unaligned place in memory.
template <class Value>
Value number_at(const char* place, bool swap_bytes) {
  std::array<char, sizeof(Value)> bytes;
  std::memcpy(bytes.data(), place, sizeof(Value));
  if (swap_bytes) std::ranges::reverse(bytes);
  return std::bit_cast<Value>(bytes);
}

/// Numbers, little-endian by default, and counted strings of a record; throws std::runtime_error at its end,
/// which the record's reader converts to an Error.
class RecordBytes {
 public:
  explicit RecordBytes(std::string_view bytes) : bytes_(bytes) {}

  std::uint64_t number(std::size_t width, bool big_endian = false);
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::string_view take(std::uint64_t size);
  std::string_view text() { return take(u32()); }  ///< after its length in four bytes
  std::string_view rest() const { return bytes_.substr(position_); }
  std::size_t position() const { return position_; }
  bool at_end() const { return position_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
};

// Reading a bag may take 64 MiB plus eight times its size, whatever its compression. These are shares of it:
// a decompressed block, a scan's points, and, doubled for vectors that grow, transforms and scan locations.
constexpr std::uint64_t mebibyte = std::uint64_t{1} << 20;
constexpr std::uint64_t largest_block(std::uint64_t file_size) {
  return 12 * mebibyte + file_size + file_size / 2;
}
constexpr std::uint64_t largest_scan(std::uint64_t file_size) { return 32 * mebibyte + 3 * file_size; }
constexpr std::uint64_t largest_index(std::uint64_t file_size) { return 8 * mebibyte + file_size; }

/// The block decompressed to exactly `size` bytes; "" and "none": unchanged. Formats: zstd, lz4 (frames),
/// bz2. Throws std::runtime_error with the reason.
std::string decompressed(std::string_view block, std::string_view format, std::uint64_t size);
/// The same of a zstd frame that says its size itself.
std::string decompressed(std::string_view zstd_frame);

}  // namespace octosurf::io
