#include "io/readers/bag_files.hpp"

namespace octosurf::test {

namespace {

std::string counted(const std::string& text) {
  return bytes_of(static_cast<std::uint32_t>(text.size())) + text;
}

}  // namespace

McapMessage cloud(double stamp_s, const std::string& topic, const std::string& frame) {
  CdrBytes message;
  message.header(stamp_s, frame).u32(1).u32(1).u32(3);
  for (const char* const axis : {"x", "y", "z"})
    message.text(axis).u32(4 * static_cast<std::uint32_t>(*axis - 'x')).u8(7).u32(1);
  message.u8(0).u32(12).u32(12).bytes(bytes_of(1.0F, 2.0F, 3.0F)).u8(1);
  return {topic, "sensor_msgs/msg/PointCloud2", stamp_s, message.all()};
}

McapMessage tf(double stamp_s, const std::string& parent, const std::string& child, double x) {
  return {"/tf", "tf2_msgs/msg/TFMessage", stamp_s,
          CdrBytes().u32(1).header(stamp_s, parent).text(child).pose(x).all()};
}

McapMessage fixed(const std::string& parent, const std::string& child, double x) {
  McapMessage message = tf(0.5, parent, child, x);
  message.topic = "/tf_static";
  return message;
}

McapMessage at(double logged_s, McapMessage message) {
  message.logged_s = logged_s;
  return message;
}

std::string mcap_record(std::uint8_t op, const std::string& body) {
  return bytes_of(op, std::uint64_t{body.size()}) + body;
}

std::string mcap_of(const std::vector<McapMessage>& messages) {
  std::string bytes = "\x89MCAP0\r\n" + mcap_record(1, counted("ros2") + counted("test"));
  std::map<std::string, std::uint16_t> channels;
  for (const McapMessage& message : messages) {
    const auto [channel, is_new] =
        channels.emplace(message.topic, static_cast<std::uint16_t>(channels.size() + 1));
    if (is_new) {
      bytes += mcap_record(
          3, bytes_of(channel->second) + counted(message.type) + counted("ros2msg") + counted(""));
      bytes += mcap_record(4, bytes_of(channel->second, channel->second) + counted(message.topic) +
                                  counted("cdr") + counted(""));
    }
    const auto logged_ns = static_cast<std::uint64_t>(std::llround(message.logged_s * 1e9));
    bytes +=
        mcap_record(5, bytes_of(channel->second, std::uint32_t{0}, logged_ns, logged_ns) + message.bytes);
  }
  return bytes + mcap_record(15, bytes_of(std::uint32_t{0})) + mcap_record(2, std::string(20, '\0')) +
         "\x89MCAP0\r\n";
}

}  // namespace octosurf::test
