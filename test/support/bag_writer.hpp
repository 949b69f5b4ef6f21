#pragma once

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>

namespace octosurf::test {

/// False where Debian's Python lacks a module that write_bag.py needs; such tests are skipped.
inline bool can_write_bags() {
  return std::system("'" OCTOSURF_BAG_PYTHON
                     "' -c 'import rosbag, rospy, sensor_msgs.msg, nav_msgs.msg, "
                     "tf2_msgs.msg, lz4.frame, zstandard' 2>/dev/null") == 0;
}
inline constexpr const char* no_bag_writer =
    "Debian's Python has no rosbag, message, lz4 or zstandard modules (./dev test installs them)";

/// Makes a bag of a recording in a folder; options as write_bag.py has them.
inline void write_bag_of(const std::filesystem::path& recording, const std::filesystem::path& bag,
                         const std::string& options = {}) {
  const std::string command = "'" OCTOSURF_BAG_PYTHON "' '" OCTOSURF_SOURCE_DIR
                              "/test/io/readers/write_bag.py' '" +
                              recording.string() + "' '" + bag.string() + "' " + options;
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

}  // namespace octosurf::test
