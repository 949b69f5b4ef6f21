#pragma once

#include <filesystem>
#include <string>

namespace octosurf::test {

/// False where there is no environment of test/peers for write_bag.py; such tests are skipped.
bool can_write_bags();
inline constexpr const char* no_bag_writer =
    "rosbags and mcap are not installed (ctest -R peers.environment.bags says why)";

/// Makes a bag of a recording in a folder; options as write_bag.py has them. One Python process, which takes
/// half a second to import ROS' messages, writes all bags of a test program.
void write_bag_of(const std::filesystem::path& recording, const std::filesystem::path& bag,
                  const std::string& options = {});

}  // namespace octosurf::test
