#include "io/readers/message_reader.hpp"

namespace octosurf::io {

MessageReader::MessageReader(std::string_view bytes, MessageEncoding encoding)
    : bytes_(bytes), encoding_(encoding) {
  if (encoding == MessageEncoding::ros1) return;
  if (encoding != MessageEncoding::cdr) fail_reading("is not serialised as ROS 1 or ROS 2 do");
  // Little-endian or big-endian plain CDR; the other encapsulations are parameter lists.
  if (bytes.size() < 4 || bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
    fail_reading(bytes.starts_with("\x28\xb5\x2f\xfd")
                     ? "compressed message by message (unpack the bag by ros2 bag convert)"
                     : "not CDR as ROS 2 writes it");
  big_endian_ = bytes[1] == 0;
  bytes_ = RecordBytes(bytes.substr(4));
}

std::uint64_t MessageReader::number(std::size_t width) {
  if (encoding_ == MessageEncoding::cdr) bytes_.take((width - bytes_.position() % width) % width);  // aligned
  return bytes_.number(width, big_endian_);
}

std::string MessageReader::text() {
  std::string_view text = bytes();
  if (encoding_ == MessageEncoding::cdr && text.ends_with('\0')) text.remove_suffix(1);
  return std::string(text);
}

}  // namespace octosurf::io
