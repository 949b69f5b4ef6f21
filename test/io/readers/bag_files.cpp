#include "io/readers/bag_files.hpp"

#include "support/bag_writer.hpp"

namespace octosurf::test {

namespace fs = std::filesystem;

namespace {

std::string poses(int count) {
  std::ostringstream text;
  text.precision(std::numeric_limits<double>::max_digits10);
  for (int i = 0; i < count; ++i) {
    const double half = 0.1 + 0.3 * i;
    text << i / 30.0 << ' ' << 0.1 * i << ' ' << -0.3 << ' ' << 1.0 / 3 << ' ' << 0 << ' '
         << std::sin(half) * 0.6 << ' ' << std::sin(half) * 0.8 << ' ' << std::cos(half) << '\n';
  }
  return text.str();
}

/// Writes times and poses beside three scans.
void write_track(const fs::path& recording) {
  write_file(recording / "times.txt", "0\n0.03333333333333333\n0.06666666666666667\n");
  write_file(recording / "poses.txt", poses(3));
}

std::string counted(const std::string& text) {
  return bytes_of(static_cast<std::uint32_t>(text.size())) + text;
}

}  // namespace

void BagFiles::SetUp() {
  if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
}

fs::path BagFiles::write_images(const std::string& name) const {
  for (int image = 0; image < 3; ++image) {
    std::vector<std::uint16_t> pixels;
    for (int i = 0; i < 24; ++i) pixels.push_back(static_cast<std::uint16_t>(1000 + 37 * i + 501 * image));
    pixels[3] = 0;
    pixels[20] = 65535;
    write_png(name + "/frame-00000" + std::to_string(image) + ".depth.png", 6, 4, pixels);
  }
  write(name + "/camera-intrinsics.txt", "5.25 0 2.5\n0 5.3 1.5\n0 0 1\n");
  write_track(folder / name);
  return folder / name;
}

fs::path BagFiles::write_clouds(const std::string& name) const {
  for (int cloud = 0; cloud < 3; ++cloud) {
    std::string points;
    for (int i = 0; i < 40; ++i)
      points += i == 7 ? bytes_of(0.0F, 0.0F, 0.0F)
                       : bytes_of(0.1F * static_cast<float>(i), 1.0F / static_cast<float>(i + 1),
                                  static_cast<float>(cloud) - 0.7F);
    write(name + "/scan-" + std::to_string(cloud) + ".pcd",
          "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 40\nHEIGHT 1\n"
          "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 40\nDATA binary\n" +
              points);
  }
  write_track(folder / name);
  return folder / name;
}

fs::path BagFiles::write_bag(const fs::path& recording, const std::string& name,
                             const std::string& options) const {
  const fs::path bag = folder / name;
  fs::create_directories(bag.parent_path());
  write_bag_of(recording, bag, options);
  return bag;
}

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
