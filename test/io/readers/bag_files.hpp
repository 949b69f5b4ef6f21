#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/scan_files.hpp"

namespace octosurf::test {

/// Writes CDR for tests: little-endian, each value aligned.
class CdrBytes {
 public:
  template <class Number>
  CdrBytes& number(Number value) {
    bytes_.resize((bytes_.size() + sizeof value - 1) / sizeof value * sizeof value);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  CdrBytes& u8(std::uint8_t value) { return number(value); }
  CdrBytes& u32(std::uint32_t value) { return number(value); }
  CdrBytes& u64(std::uint64_t value) { return number(value); }
  CdrBytes& f32(float value) { return number(value); }
  CdrBytes& f64(double value) { return number(value); }
  CdrBytes& bytes(std::string_view value) {
    u32(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  CdrBytes& text(const std::string& value) { return bytes(value + '\0'); }
  CdrBytes& header(double stamp_s, const std::string& frame) {
    const auto seconds = static_cast<std::int32_t>(stamp_s);
    return number(seconds).u32(static_cast<std::uint32_t>((stamp_s - seconds) * 1e9 + 0.5)).text(frame);
  }
  /// x 0 0 and a quaternion 0 0 0 qw.
  CdrBytes& pose(double x, double qw = 1) { return f64(x).f64(0).f64(0).f64(0).f64(0).f64(0).f64(qw); }
  std::string all() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  std::string bytes_;
};

/// For what bags that others write (bag_reading_test.py) do not have.
struct McapMessage {
  std::string topic, type;  ///< sensor_msgs/msg/Image
  double logged_s = 0;
  std::string bytes;
};
/// One point (1, 2, 3).
McapMessage cloud(double stamp_s, const std::string& topic = "/points", const std::string& frame = "lidar");
/// One transform, x along the parent's axis.
McapMessage tf(double stamp_s, const std::string& parent, const std::string& child, double x);
McapMessage fixed(const std::string& parent, const std::string& child, double x);  ///< on /tf_static
/// The message as recorded at another time than its stamp's.
McapMessage at(double logged_s, McapMessage message);

/// A record of MCAP.
std::string mcap_record(std::uint8_t op, const std::string& body);
/// An MCAP without chunks, check sums and summary.
std::string mcap_of(const std::vector<McapMessage>& messages);

}  // namespace octosurf::test
