#pragma once

#include "apps/command.hpp"
#include "apps/running.hpp"
#include "dds/vendor.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace octosurf::test {

inline const std::string image_topic = "/camera/depth/image";

/// A bag played through Fast DDS, as a robot's drivers would publish it.
class Player {
 public:
  /// The bag's scans are those of the topics "/camera/depth/image" or "/lidar/points".
  Player(Vendor& vendor, const std::filesystem::path& bag, Qos scans);

  std::size_t scans() const { return scans_.size(); }
  /// Until a node hears of all that is published: Fast DDS knows of the node earlier than the node of it, and
  /// to a reader, what a reliable writer has sent before its first heartbeat is the past. So it is spoken to
  /// until it tells that it has heard, by transforms of nothing and scans without a depth, which it refuses.
  bool is_heard(const Subscription& status) const;
  /// Messages up to and with the scans [first, last).
  void play(std::size_t first, std::size_t last) const;
  std::int32_t shift_s = 0;  ///< added to their time stamps

  /// The first and the last message on a topic.
  const Json& first(const std::string& topic) const;
  const Json& last(const std::string& topic) const;
  void publish(const std::string& topic, const Json& message) const {
    publishers_.at(topic)->publish(message);
  }
  void publish(const std::string& topic, const std::string& cdr) const {
    publishers_.at(topic)->publish(cdr);
  }

 private:
  std::vector<std::pair<std::string, Json>> messages_;  // and their topics
  std::vector<std::size_t> scans_;                      // indices of messages_
  std::map<std::string, std::unique_ptr<Publisher>> publishers_;
};

/// Runs octosurf-dds on the loopback, in a domain of this process's own.
class NodeTest : public CommandTest {
 protected:
  void SetUp() override;

  void start(const std::vector<std::string>& arguments);
  /// Records as record() does, starts a node that hears the player, and waits until it does.
  void start_heard(const std::vector<std::string>& arguments, Qos qos,
                   const std::string& simulate = "--frames 6", const std::string& bag = {});
  /// Plays scans [first, last), and waits until all that has come was mapped, refused or dropped, and that
  /// was `mapped` mapped.
  void play_mapped(std::size_t first, std::size_t last, std::uint64_t mapped);
  Json last_status() const { return status->last(); }
  /// Ends it as Ctrl-C does.
  void end();
  bool says(const std::string& text) const {
    return wait_until([&] { return node->errors().find(text) != std::string::npos; });
  }

  /// A simulated recording as bag "walk.db3", options of `simulate` and of write_bag.py, and the map that
  /// `octosurf map` makes of it, "offline". Made once in a process.
  void record(const std::string& simulate, const std::string& bag) const;
  /// The map of "walk.db3" as a node makes it.
  void map_offline(const std::string& map, const std::string& more = {}) const;
  void expect_live_is(const std::string& map) const;

  std::uint32_t domain = 0;
  std::unique_ptr<Vendor> vendor;
  std::unique_ptr<Player> player;
  std::unique_ptr<Running> node;
  std::unique_ptr<Subscription> status;
};

}  // namespace octosurf::test
