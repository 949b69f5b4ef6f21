#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/bounded_file.hpp"

#include <bit>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace octosurf::io {

/// Reads a ROS message's fields in the order of its definition; the counterpart of MessageWriter. One
/// description of a message serves both of ROS' encodings. Throws std::runtime_error if the message ends too
/// early; never allocates for missing data.
class MessageReader {
 public:
  /// `bytes` must outlive it. Throws std::runtime_error for another encoding.
  MessageReader(std::string_view bytes, MessageEncoding encoding);

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  float f32() { return std::bit_cast<float>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  std::string text();
  std::string_view bytes() { return bytes_.take(u32()); }  ///< of a uint8[]
  /// A Header begins with a sequence number, as in ROS 1.
  bool numbers_headers() const { return encoding_ == MessageEncoding::ros1; }

 private:
  std::uint64_t number(std::size_t width);

  RecordBytes bytes_;
  MessageEncoding encoding_;
  bool big_endian_ = false;
};

inline std::unique_ptr<MessageReader> message_reader(std::string_view bytes, MessageEncoding encoding) {
  return std::make_unique<MessageReader>(bytes, encoding);
}

}  // namespace octosurf::io
