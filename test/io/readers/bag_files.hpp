#pragma once

#include "io/readers/bag.hpp"
#include "io/readers/scan_files.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace octosurf::test {

/// Recordings in folders, and bags of them as others write them (write_bag.py).
class BagFiles : public ScanFiles {
 protected:
  void SetUp() override;

  /// Three images of 6×4 pixels with readings and none; poses that turn and move. Poses are stamped from 0 at
  /// 30 Hz.
  std::filesystem::path write_images(const std::string& name = "images") const;
  /// Three clouds of 40 points, one of them at the origin.
  std::filesystem::path write_clouds(const std::string& name = "clouds") const;
  /// The options are those of write_bag.py. Skips the test if a Python module is missing.
  std::filesystem::path write_bag(const std::filesystem::path& recording, const std::string& name,
                                  const std::string& options = {}) const;
};

/// Messages as a bag has them, for what write_bag.py does not write: little-endian, each value aligned.
class CdrBytes {
 public:
  CdrBytes& u8(std::uint8_t value) { return put(value); }
  CdrBytes& u32(std::uint32_t value) { return put(value); }
  CdrBytes& u64(std::uint64_t value) { return put(value); }
  CdrBytes& f32(float value) { return put(value); }
  CdrBytes& f64(double value) { return put(value); }
  CdrBytes& text(const std::string& value);
  CdrBytes& bytes(std::string_view value);
  CdrBytes& header(double stamp_s, const std::string& frame);
  CdrBytes& pose(double x, double qw = 1);  ///< x 0 0 and a quaternion 0 0 0 qw
  std::string all() const { return std::string("\0\1\0\0", 4) + bytes_; }

 private:
  template <class Number>
  CdrBytes& put(Number value) {
    bytes_.resize((bytes_.size() + sizeof value - 1) / sizeof value * sizeof value);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  std::string bytes_;
};

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
