#pragma once

#include "apps/command.hpp"
#include "apps/running.hpp"
#include "dds/vendor.hpp"
#include "io/readers/bag.hpp"

#include <memory>
#include <string>
#include <vector>

namespace octosurf::test {

using StatusSupport = octosurf_msgs::msg::dds_::Status_PubSubType;
using SaveClient = Client<octosurf_msgs::srv::dds_::Save_Request_PubSubType,
                          octosurf_msgs::srv::dds_::Save_Response_PubSubType>;

using Status = Subscription<StatusSupport>;

/// A bag played through Fast DDS, as a robot's drivers would publish it.
class Player {
 public:
  /// The bag's scans are those of the topics "/camera/depth/image" or "/lidar/points".
  Player(Vendor& vendor, const std::filesystem::path& bag, Qos scans);

  std::size_t scans() const { return scans_.size(); }
  /// Until a node hears of all that is published: Fast DDS knows of the node earlier than the node of it, and
  /// to a reader, what a reliable writer has sent before its first heartbeat is the past. So it is spoken to
  /// until it tells that it has heard, by transforms of nothing and scans without a depth, which it refuses.
  bool is_heard(const Status& status, std::uint32_t scan_publishers = 1) const;
  /// Messages up to and with the scans [first, last).
  void play(std::size_t first, std::size_t last);
  std::int32_t shift_s = 0;  ///< added to their time stamps

  Publisher<sensor_msgs::msg::dds_::Image_PubSubType> images;
  Publisher<sensor_msgs::msg::dds_::CameraInfo_PubSubType> cameras;
  Publisher<sensor_msgs::msg::dds_::PointCloud2_PubSubType> clouds;
  Publisher<tf2_msgs::msg::dds_::TFMessage_PubSubType> tf, tf_static;

  struct Message {
    std::string topic, cdr;
  };
  const std::vector<Message>& messages() const { return messages_; }

 private:
  void publish(const Message& message) const;

  std::vector<Message> messages_;
  std::vector<std::size_t> scans_;  // indices of messages_
  bool depth_ = false;
};

/// Runs octosurf-dds on the loopback, in a domain of this process's own.
class NodeTest : public CommandTest {
 protected:
  void SetUp() override;

  std::unique_ptr<Running> start(const std::vector<std::string>& arguments) const;
  /// Ends it as Ctrl-C does; its exit code.
  static int end(Running& node);

  /// A simulated recording as bag "walk.db3", options of `simulate` and of write_bag.py, and the map that
  /// `octosurf map` makes of it, "offline". Made once in a process.
  void record(const std::string& simulate = "--frames 6", const std::string& bag = {}) const;
  /// The map of "walk.db3" as a node makes it.
  void map_offline(const std::string& map, const std::string& more = {}) const;
  void expect_live_is(const std::string& map) const;

  std::uint32_t domain = 0;
  std::unique_ptr<Vendor> vendor;
};

}  // namespace octosurf::test
