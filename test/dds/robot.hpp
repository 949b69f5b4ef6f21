#pragma once

#include "apps/command.hpp"
#include "apps/running.hpp"
#include "dds/vendor.hpp"
#include "io/readers/bag.hpp"
#include "support/bag_writer.hpp"
#include "support/paths.hpp"

#include <cstdlib>
#include <unistd.h>
#include <vector>

namespace octosurf::test {

inline const std::string image_topic = "/camera/depth/image";

// No multicast, which loopbacks need not have; peers are looked for by unicast.
inline constexpr const char* loopback =
    "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>";

/// Adds to all time stamps.
inline void shift(Json& message, std::int32_t by_s) {
  if (message.is_object() && message.contains("stamp"))
    message["stamp"]["sec"] = message["stamp"]["sec"].get<std::int32_t>() + by_s;
  if (message.is_structured())
    for (Json& part : message) shift(part, by_s);
}

/// A bag played through Fast DDS, as a robot's drivers would publish it.
class Player {
 public:
  /// The bag's scans are those of the topics "/camera/depth/image" or "/lidar/points".
  Player(Vendor& vendor, const std::filesystem::path& bag, Qos scans) {
    const auto advertise = [&](const std::string& topic, const std::string& type, Qos qos) {
      if (!publishers_.contains(topic))
        publishers_[topic] = std::make_unique<Publisher>(vendor, "rt" + topic, type, qos);
    };
    advertise("/tf", "tf2_msgs/TFMessage", Qos::reliable);
    advertise("/tf_static", "tf2_msgs/TFMessage", Qos::latched);
    const auto source = io::open_bag({bag});
    source->read_all(
        [&](const io::BagMessage& message) {
          const io::BagTopic& topic = source->topics()[message.topic];
          const bool is_scan = topic.name == image_topic || topic.name == "/lidar/points";
          if (is_scan) scans_.push_back(messages_.size());
          advertise(topic.name, topic.type, is_scan ? scans : Qos::best_effort);
          messages_.emplace_back(topic.name, decoded(topic.type, std::string(message.bytes)));
        },
        nullptr);
  }

  std::size_t scans() const { return scans_.size(); }
  /// Until a node hears of all that is published: Fast DDS knows of the node earlier than the node of it, and
  /// to a reader, what a reliable writer has sent before its first heartbeat is the past. So it is spoken to
  /// until it tells that it has heard, by transforms of nothing and scans without a depth, which it refuses.
  bool is_heard(const Subscription& status) const {
    const auto heard = [&](const std::function<void()>& speak, const char* count) {
      const Json before = status.last().at(count);
      return spoken_until(speak, [&] { return status.last().at(count) > before; });
    };
    const bool depth = publishers_.contains(image_topic);
    const Json nothing{{"header", {{"frame_id", "map"}}}, {"width", 1}, {"height", 1}};  // which is refused
    return wait_until([&] {
             const Json now = status.last();
             return now.at("scan_publishers") == 1 && now.at("camera_publishers") == (depth ? 1 : 0) &&
                    now.at("transform_publishers") == 2;
           }) &&
           heard([&] { publish("/tf", Json::object()); }, "transforms") &&
           heard([&] { publish(depth ? image_topic : "/lidar/points", nothing); }, "refused");
  }
  /// Messages up to and with the scans [first, last).
  void play(std::size_t first, std::size_t last) const {
    const std::size_t begin = first == 0 ? 0 : scans_.at(first - 1) + 1;
    for (std::size_t i = begin; i <= scans_.at(last - 1); ++i) {
      Json message = messages_[i].second;
      if (shift_s != 0) shift(message, shift_s);
      publish(messages_[i].first, message);
    }
  }
  std::int32_t shift_s = 0;  ///< added to their time stamps

  /// The first and the last message on a topic.
  const Json& first(const std::string& topic) const {
    return std::ranges::find(messages_, topic, &std::pair<std::string, Json>::first)->second;
  }
  const Json& last(const std::string& topic) const {
    const auto of_topic = [&](const auto& message) { return message.first == topic; };
    return std::find_if(messages_.rbegin(), messages_.rend(), of_topic)->second;
  }
  /// JSON, or a text of CDR.
  template <class Message>
  void publish(const std::string& topic, const Message& message) const {
    publishers_.at(topic)->publish(message);
  }

 private:
  std::vector<std::pair<std::string, Json>> messages_;  // and their topics
  std::vector<std::size_t> scans_;                      // indices of messages_
  std::map<std::string, std::unique_ptr<Publisher>> publishers_;
};

/// Runs octosurf-dds on the loopback, in a domain of this process's own.
class NodeTest : public CommandTest {
 protected:
  void SetUp() override {
    if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
    setenv("CYCLONEDDS_URI", loopback, 1);
    // Tests run beside each other; ports below the ephemeral ones.
    domain = 1 + static_cast<std::uint32_t>(getpid()) % 100;
    vendor = std::make_unique<Vendor>(domain);
  }

  void start(const std::vector<std::string>& arguments) {
    // No budget: what waits is looked at in the end, while the node goes on for later scans.
    std::vector<std::string> all{
        "--domain", std::to_string(domain), "--publish", "0.05", "--detection-budget",
        "0",        "--resolution",         "0.05",      "-o",   "live"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    node = std::make_unique<Running>(folder, all, paths::dds_node());
    status =
        std::make_unique<Subscription>(*vendor, "rt/octosurf/status", "octosurf_msgs/Status", Qos::latched);
  }
  /// Records as record() does, starts a node that hears the player, and waits until it does.
  void start_heard(const std::vector<std::string>& arguments, Qos qos,
                   const std::string& simulate = "--frames 6", const std::string& bag = {}) {
    record(simulate, bag);
    if (HasFatalFailure()) return;
    if (!player) player = std::make_unique<Player>(*vendor, folder / "walk.db3", qos);
    start(arguments);
    ASSERT_TRUE(player->is_heard(*status)) << node->errors();
  }
  /// Plays scans [first, last), and waits until all that has come was mapped, refused or dropped, and that
  /// was `mapped` mapped.
  void play_mapped(std::size_t first, std::size_t last, std::uint64_t mapped) {
    player->play(first, last);
    ASSERT_TRUE(wait_until([&] {
      const Json now = last_status();
      return now.at("mapped") == mapped && now.at("waiting") == 0;
    })) << node->errors()
        << last_status();
  }
  Json last_status() const { return status->last(); }
  /// Ends it as Ctrl-C does.
  void end() {
    node->send(SIGINT);
    EXPECT_EQ(node->wait(), 0) << node->errors();
  }
  bool says(const std::string& text) const {
    return wait_until([&] { return node->errors().find(text) != std::string::npos; });
  }

  /// A simulated recording as bag "walk.db3", options of `simulate` and of write_bag.py, and the map that
  /// `octosurf map` makes of it, "offline". Made once in a process.
  void record(const std::string& simulate, const std::string& bag) const {
    made_once(simulate + bag, [&] {
      simulate_for_bag("sim", simulate);
      write_bag_of(folder / "sim", folder / "walk.db3", bag);
      std::filesystem::remove_all(folder / "sim");
      map_offline("offline");
    });
    ASSERT_GT(info("offline").at("surfaces"), 3);
  }
  /// The map of "walk.db3" as a node makes it.
  void map_offline(const std::string& map, const std::string& more = {}) const {
    run_well("map walk.db3 --force -o " + map + " --resolution 0.05 --detection-budget 0 " + more);
  }
  void expect_live_is(const std::string& map) const {
    for (const char* ending : {".surfaces", ".bt"})
      EXPECT_TRUE(read(std::string("live") + ending) == read(map + ending)) << ending;
  }

  std::uint32_t domain = 0;
  std::unique_ptr<Vendor> vendor;
  std::unique_ptr<Player> player;
  std::unique_ptr<Running> node;
  std::unique_ptr<Subscription> status;
};

}  // namespace octosurf::test
