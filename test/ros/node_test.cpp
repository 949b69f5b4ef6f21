// The component of ROS 2 beside publishers, subscribers and clients of rclcpp.
#include "apps/command.hpp"
#include "apps/running.hpp"
#include "io/readers/bag.hpp"
#include "support/bag_writer.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <octosurf_msgs/msg/status.hpp>
#include <octosurf_msgs/msg/surfaces.hpp>
#include <octosurf_msgs/srv/changes.hpp>
#include <octosurf_msgs/srv/save.hpp>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/float32_multi_array.hpp>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

namespace octosurf::test {
namespace {

class RosNode : public CommandTest {
 protected:
  void SetUp() override {
    if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
    // A domain of this process's own, on this machine alone.
    setenv("ROS_DOMAIN_ID", std::to_string(101 + getpid() % 100).c_str(), 1);
    setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 1);
    rclcpp::init(0, nullptr);
    robot = std::make_shared<rclcpp::Node>("robot");
    simulate_for_bag("sim", "--frames 6");
    write_bag_of(folder / "sim", folder / "walk.db3", {});
    run_well("map walk.db3 --force -o offline --resolution 0.05 --detection-budget 0");
  }
  void TearDown() override {
    robot.reset();
    if (rclcpp::ok()) rclcpp::shutdown();
  }

  bool spin_until(const std::function<bool()>& holds) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > end) return false;
      rclcpp::spin_some(robot);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
  }

  template <class Message>
  std::shared_ptr<Message> hear(const std::string& topic, const rclcpp::QoS& qos) {
    auto last = std::make_shared<Message>();
    heard.push_back(
        robot->create_subscription<Message>(topic, qos, [last](const Message& message) { *last = message; }));
    return last;
  }

  template <class Service>
  typename Service::Response call(const std::string& name, typename Service::Request request) const {
    const auto client = robot->create_client<Service>(name);
    EXPECT_TRUE(spin_until([&] { return client->service_is_ready(); })) << name;
    auto reply = client->async_send_request(std::make_shared<typename Service::Request>(request));
    EXPECT_EQ(rclcpp::spin_until_future_complete(robot, reply, std::chrono::minutes(1)),
              rclcpp::FutureReturnCode::SUCCESS);
    return *reply.future.get();
  }

  /// The bag's messages, as they came.
  void play() {
    std::vector<std::pair<io::BagTopic, rclcpp::SerializedMessage>> messages;
    const auto source = io::open_bag({folder / "walk.db3"});
    source->read_all(
        [&](const io::BagMessage& message) {
          auto& raw = messages.emplace_back(source->topics()[message.topic], message.bytes.size())
                          .second.get_rcl_serialized_message();
          std::memcpy(raw.buffer, message.bytes.data(), message.bytes.size());
          raw.buffer_length = message.bytes.size();
        },
        nullptr);
    for (auto [topic, raw] : messages) {
      if (publishers.contains(topic.name)) continue;
      rclcpp::QoS qos{rclcpp::KeepLast(1000)};
      if (topic.name == "/tf_static") qos.transient_local();
      const std::string type = topic.type.insert(topic.type.find('/'), "/msg");
      publishers[topic.name] = robot->create_generic_publisher(topic.name, type, qos);
    }
    ASSERT_TRUE(spin_until([&] {
      return std::ranges::all_of(publishers,
                                 [](const auto& one) { return one.second->get_subscription_count() > 0; });
    }));
    for (const auto& [topic, raw] : messages) publishers[topic.name]->publish(raw);
  }

  rclcpp::Node::SharedPtr robot;
  std::vector<rclcpp::SubscriptionBase::SharedPtr> heard;
  std::map<std::string, rclcpp::GenericPublisher::SharedPtr> publishers;
};

TEST_F(RosNode, MapsABagsMessagesToTheMapOfTheBag) {
  Running node(folder,
               {"--ros-args", "-p", "depth:=/camera/depth/image", "-p", "output:=live", "-p",
                "reliable:=true", "-p", "resolution:=0.05", "-p", "detection_budget:=0", "-p",
                "publish:=0.05", "-p", "base:=camera", "-p", "radius:=0.0", "-r", "__node:=mapper"},
               OCTOSURF_ROS_NODE);
  const auto latched = rclcpp::QoS(1).transient_local();
  const auto status = hear<octosurf_msgs::msg::Status>("/mapper/status", latched);
  const auto surfaces = hear<octosurf_msgs::msg::Surfaces>("/mapper/surfaces", latched);
  const auto heights =
      hear<std_msgs::msg::Float32MultiArray>("/mapper/heights", rclcpp::QoS(1).best_effort());
  ASSERT_TRUE(spin_until([&] {
    return status->transform_publishers == 0 && !status->header.frame_id.empty();
  })) << node.errors();
  play();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(spin_until([&] { return status->mapped == 6; })) << node.errors() << status->last_refusal;
  const std::size_t all = info("offline").at("surfaces");
  EXPECT_TRUE(spin_until([&] { return surfaces->surfaces.size() == all; }));
  EXPECT_EQ(surfaces->header.frame_id, "map");
  ASSERT_TRUE(spin_until([&] { return !heights->data.empty(); })) << node.errors();
  ASSERT_EQ(heights->layout.dim.size(), 2u);
  EXPECT_EQ(heights->layout.dim[0].size * heights->layout.dim[1].size, heights->data.size());

  const auto changes =
      call<octosurf_msgs::srv::Changes>("/mapper/changes", octosurf_msgs::srv::Changes::Request());
  EXPECT_EQ(changes.changed.surfaces.size(), all);
  octosurf_msgs::srv::Save::Request copy;
  copy.file = "copy";
  EXPECT_TRUE(call<octosurf_msgs::srv::Save>("/mapper/save", copy).success);
  copy.file = "../copy";
  EXPECT_NE(call<octosurf_msgs::srv::Save>("/mapper/save", copy).message.find("plain name"),
            std::string::npos);
  EXPECT_TRUE(read("copy.surfaces") == read("offline.surfaces"));
  node.send(SIGINT);
  EXPECT_EQ(node.wait(), 0) << node.errors();
  for (const char* ending : {".surfaces", ".bt"})
    EXPECT_TRUE(read(std::string("live") + ending) == read(std::string("offline") + ending)) << ending;
}

TEST_F(RosNode, RefusesParametersThatMakeNoSense) {
  for (const std::string wrong : {"resolution:=-1.0", "publish:=soon"}) {
    Running node(folder, {"--ros-args", "-p", "depth:=/d", "-p", "output:=m", "-p", wrong},
                 OCTOSURF_ROS_NODE);
    EXPECT_NE(node.wait(), 0) << wrong;
    EXPECT_NE(node.errors().find(wrong.substr(0, wrong.find(':'))), std::string::npos) << node.errors();
  }
}

}  // namespace
}  // namespace octosurf::test
