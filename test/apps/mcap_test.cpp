// `octosurf map --mcap`: the file is whole however the run ends, and never written over unasked.
#include "apps/command.hpp"
#include "io/readers/bag.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <map>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class McapLog : public CommandTest {
 protected:
  /// Messages by topic.
  std::map<std::string, int> messages(const std::string& file) const {
    const auto bag = io::open_mcap(folder / file);
    std::map<std::string, int> counts;
    bag->read_all([&](const io::BagMessage& message) { ++counts[bag->topics()[message.topic].name]; },
                  nullptr);
    return counts;
  }
  /// Files whose names begin like this: a temporary one's does with the name of what it becomes.
  std::size_t files(const std::string& beginning) const {
    const std::filesystem::directory_iterator all(folder);
    return static_cast<std::size_t>(std::count_if(begin(all), end(all), [&](const auto& entry) {
      return entry.path().filename().string().starts_with(beginning);
    }));
  }
};

TEST_F(McapLog, ABadScanEndsTheFileWithWhatIsMapped) {
  write_floor();
  write("floor/3.pgm", read("floor/3.pgm").substr(0, 100));
  error_of("map floor -o m --mcap run.mcap", 1);
  const auto counts = messages("run.mcap");
  EXPECT_EQ(counts.at("/tf"), 3);
  EXPECT_GE(counts.at("/surfaces"), 2);
  EXPECT_EQ(files("run.mcap"), 1U);
}

TEST_F(McapLog, ARunThatMapsNothingLeavesNothing) {
  write_floor();
  write("floor/0.pgm", read("floor/0.pgm").substr(0, 100));
  error_of("map floor -o m --mcap run.mcap", 1);
  EXPECT_EQ(files("run.mcap"), 0U);
}

TEST_F(McapLog, WhatIsThereStays) {
  write_floor();
  write("run.mcap", "mine");
  EXPECT_THAT(error_of("map floor -o m --mcap run.mcap", 2),
              AllOf(HasSubstr("run.mcap"), HasSubstr("--force")));
  EXPECT_EQ(read("run.mcap"), "mine");
  run_well("map floor -o m --mcap run.mcap --force");
  EXPECT_EQ(messages("run.mcap").at("/tf"), 6);
  EXPECT_THAT(error_of("export m --to run.mcap", 2), HasSubstr("--force"));
}

}  // namespace
}  // namespace octosurf::test
