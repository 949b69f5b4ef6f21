#pragma once

#include "io/readers/bag.hpp"

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
  virtual ~MessageReader() = default;

  virtual std::uint8_t u8() = 0;
  virtual std::uint32_t u32() = 0;
  virtual std::uint64_t u64() = 0;
  virtual double f64() = 0;
  virtual std::string text() = 0;
  virtual std::string_view bytes() = 0;      ///< of a uint8[]
  virtual bool numbers_headers() const = 0;  ///< a Header begins with a sequence number, as in ROS 1
  virtual std::size_t left() const = 0;      ///< remaining bytes
};

/// Reads `bytes`, which must outlive it. Throws std::runtime_error for another encoding.
std::unique_ptr<MessageReader> message_reader(std::string_view bytes, MessageEncoding encoding);

}  // namespace octosurf::io
