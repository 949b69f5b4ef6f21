// Bags as ROS 2's own recorder wrote them (../shared/data/ros2_bags), message by message.
#include "io/readers/bag.hpp"
#include "io/readers/sensor_messages.hpp"
#include "support/paths.hpp"

#include <gtest/gtest.h>
#include <map>
#include <set>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;

class ForeignBags : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::is_directory(folder)) GTEST_SKIP() << folder << " is missing";
  }

  struct Read {
    std::string topic, type, text;
    std::int64_t logged_ns = 0;
    bool operator==(const Read&) const = default;
  };
  /// All messages; of std_msgs/String the text. Each is read a second time by its place.
  std::vector<Read> read(const std::string& name) const {
    const auto bag = io::open_bag({fs::path(folder) / name});
    std::vector<Read> all;
    std::vector<std::pair<io::MessagePlace, std::string>> places;
    bag->read_all(
        [&](const io::BagMessage& message) {
          const io::BagTopic& topic = bag->topics()[message.topic];
          EXPECT_EQ(topic.encoding, MessageEncoding::cdr);
          const auto reader = io::message_reader(message.bytes, topic.encoding);
          const std::string text = topic.type == "std_msgs/String" ? reader->text() : "";
          all.push_back({topic.name, topic.type, text, message.logged_ns});
          places.emplace_back(message.place, message.bytes);
        },
        nullptr);
    for (auto place = places.rbegin(); place != places.rend(); ++place)
      EXPECT_EQ(bag->read(place->first), place->second);
    return all;
  }

  const std::string folder = test::paths::data() + "/ros2_bags";
};

TEST_F(ForeignBags, BothContainersHoldTheSame) {
  for (const std::string name : {"talker", "wbag_0", "cdr_test_0"}) {
    std::map<std::string, std::size_t> of_mcap, of_sqlite;
    const std::vector<Read> mcap = read(name + ".mcap");
    EXPECT_GE(mcap.size(), 7U) << name;
    for (const Read& message : mcap) ++of_mcap[message.topic + " " + message.type];
    for (const Read& message : read(name + ".db3")) ++of_sqlite[message.topic + " " + message.type];
    EXPECT_EQ(of_mcap, of_sqlite) << name;
  }
  EXPECT_EQ(read("only_topics.mcap").size(), 7U);  // as its statistics say
  EXPECT_EQ(read("wbag_0.mcap").size(), 1246U);
}

TEST_F(ForeignBags, TheTalkerCounts) {
  for (const std::string name : {"talker.mcap", "talker.db3"}) {
    int count = 0;
    for (const Read& message : read(name))
      if (message.topic == "/topic") {
        EXPECT_EQ(message.text, "Hello, world! " + std::to_string(count++)) << name;
      }
    EXPECT_GE(count, 5) << name;
  }
}

TEST_F(ForeignBags, TopicsWithoutMessagesAreListed) {
  const auto bag = io::open_bag({fs::path(folder) / "talker.mcap"});
  std::set<std::string> heard, listed;
  bag->read_all([&](const io::BagMessage& message) { heard.insert(bag->topics()[message.topic].name); },
                nullptr);
  for (const io::BagTopic& topic : bag->topics()) listed.insert(topic.name);
  EXPECT_EQ(heard, (std::set<std::string>{"/rosout", "/topic"}));
  EXPECT_EQ(listed, (std::set<std::string>{"/parameter_events", "/rosout", "/topic"}));
}

}  // namespace
}  // namespace octosurf::test
