#pragma once

#include "io/cdr_bytes.hpp"
#include "io/readers/bag.hpp"
#include "io/readers/scan_files.hpp"

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

/// For what write_bag.py does not write.
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
