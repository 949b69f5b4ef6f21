#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <span>
#include <string>

#include <octosurf/ros_messages.hpp>

namespace octosurf::io {

/// Receives a ROS message field by field, in the order of its definition, so that one description serves all
/// encodings.
class MessageWriter {
 public:
  virtual ~MessageWriter() = default;

  virtual void begin_message() = 0;
  virtual void end_message() = 0;
  virtual void field(const char* name) = 0;  ///< the next value written is the field's
  virtual void begin_list(std::size_t size) = 0;
  virtual void end_list() = 0;
  virtual void write(double value) = 0;
  virtual void write(float value) = 0;
  virtual void write(std::uint32_t value) = 0;
  virtual void write(std::int32_t value) = 0;
  virtual void write(std::uint16_t value) = 0;
  virtual void write(std::uint8_t value) = 0;
  virtual void write(std::uint64_t value) = 0;
  virtual void write(bool value) = 0;
  virtual void write(const std::string& value) = 0;
  virtual void write(std::span<const float> list) = 0;
  virtual void write(std::span<const std::int8_t> list) = 0;

  virtual bool numbers_headers() const {
    return false;
  }  ///< a Header begins with a sequence number, as in ROS 1

  /// Would otherwise convert the pointer to bool.
  void write(const char*) = delete;

  template <class Value>
  void field(const char* name, const Value& value) {
    field(name);
    write(value);
  }
};

/// The message as serialised by ROS 2: XCDR1, little-endian, after its encapsulation header.
std::string cdr_of(const std::function<void(MessageWriter&)>& message);

/// Writes the message to `file`: as JSON (NaN as null) or, if it ends in .cdr, as cdr_of() gives it. Throws
/// Error(usage) for other endings and for a file that exists without `force`, Error(output) if it cannot be
/// written.
void write_message(const std::function<void(MessageWriter&)>& message, const std::filesystem::path& file,
                   bool force);

/// The message's bytes. Throws Error(usage) for an encoding that ROS does not have.
std::string message_bytes(const std::function<void(MessageWriter&)>& message, MessageEncoding encoding);

}  // namespace octosurf::io
