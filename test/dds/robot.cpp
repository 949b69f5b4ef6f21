#include "dds/robot.hpp"

#include "support/bag_writer.hpp"
#include "support/paths.hpp"

#include <cstdlib>
#include <unistd.h>

namespace octosurf::test {
namespace {

// No multicast, which loopbacks need not have; peers are looked for by unicast.
constexpr const char* loopback =
    "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>";

bool is_scan(const std::string& topic) { return topic == "/camera/depth/image" || topic == "/lidar/points"; }

}  // namespace

Player::Player(Vendor& vendor, const std::filesystem::path& bag, Qos scans)
    : images(vendor, "rt/camera/depth/image", scans),
      cameras(vendor, "rt/camera/depth/camera_info", Qos::best_effort),
      clouds(vendor, "rt/lidar/points", scans),
      tf(vendor, "rt/tf", Qos::reliable),
      tf_static(vendor, "rt/tf_static", Qos::latched) {
  const auto source = io::open_bag({bag});
  source->read_all(
      [&](const io::BagMessage& message) {
        const std::string& topic = source->topics()[message.topic].name;
        if (is_scan(topic)) scans_.push_back(messages_.size());
        depth_ |= topic == "/camera/depth/image";
        messages_.push_back({topic, std::string(message.bytes)});
      },
      nullptr);
}

bool Player::is_heard(const Status& status, std::uint32_t scan_publishers) const {
  const auto heard = [&](const std::function<void()>& speak, const std::function<std::uint64_t()>& count) {
    const std::uint64_t before = count();
    return spoken_until(speak, [&] { return count() > before; });
  };
  sensor_msgs::msg::dds_::Image_ image;
  sensor_msgs::msg::dds_::PointCloud2_ cloud;
  image.header().frame_id("map");
  cloud.header().frame_id("map");
  cloud.width(1);  // a point without fields, which is refused
  cloud.height(1);
  const auto speak = [&] { depth_ ? images.publish(image) : clouds.publish(cloud); };
  return wait_until([&] {
           const auto now = status.last();
           return now.scan_publishers() == scan_publishers && now.camera_publishers() == (depth_ ? 1 : 0) &&
                  now.transform_publishers() == 2;
         }) &&
         heard([&] { tf.publish({}); }, [&] { return status.last().transforms(); }) &&
         heard(speak, [&] { return status.last().refused(); });
}

void Player::publish(const Message& message) const {
  using namespace sensor_msgs::msg::dds_;
  using tf2_msgs::msg::dds_::TFMessage_PubSubType;
  const auto shift = [this](auto& header) { header.stamp().sec(header.stamp().sec() + shift_s); };
  const auto transforms = [&] {
    auto moved = deserialised<TFMessage_PubSubType>(message.cdr);
    for (auto& transform : moved.transforms()) shift(transform.header());
    return moved;
  };
  if (message.topic == "/camera/depth/image") {
    auto image = deserialised<Image_PubSubType>(message.cdr);
    shift(image.header());
    images.publish(image);
  }
  if (message.topic == "/camera/depth/camera_info")
    cameras.publish(deserialised<CameraInfo_PubSubType>(message.cdr));
  if (message.topic == "/lidar/points") clouds.publish(deserialised<PointCloud2_PubSubType>(message.cdr));
  if (message.topic == "/tf") tf.publish(transforms());
  if (message.topic == "/tf_static") tf_static.publish(deserialised<TFMessage_PubSubType>(message.cdr));
}

void Player::play(std::size_t first, std::size_t last) {
  const std::size_t begin = first == 0 ? 0 : scans_.at(first - 1) + 1;
  for (std::size_t i = begin; i <= scans_.at(last - 1); ++i) publish(messages_[i]);
}

void NodeTest::SetUp() {
  if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
  setenv("CYCLONEDDS_URI", loopback, 1);
  domain = 1 + static_cast<std::uint32_t>(getpid()) %
                   100;  // tests run beside each other; ports below the ephemeral ones
  vendor = std::make_unique<Vendor>(domain);
}

std::unique_ptr<Running> NodeTest::start(const std::vector<std::string>& arguments) const {
  // No budget: what waits is looked at in the end, while the node goes on for later scans.
  std::vector<std::string> all{"--domain", std::to_string(domain), "--publish", "0.05", "--detection-budget",
                               "0",        "--resolution",         "0.05"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return std::make_unique<Running>(folder, all, paths::dds_node());
}

int NodeTest::end(Running& node) {
  node.send(SIGINT);
  return node.wait();
}

void NodeTest::record(const std::string& simulate, const std::string& bag) const {
  made_once(simulate + bag, [&] {
    simulate_for_bag("sim", simulate);
    write_bag_of(folder / "sim", folder / "walk.db3", bag);
    std::filesystem::remove_all(folder / "sim");
    map_offline("offline");
  });
  ASSERT_GT(info("offline").at("surfaces"), 3);
}

void NodeTest::map_offline(const std::string& map, const std::string& more) const {
  run_well("map walk.db3 --force -o " + map + " --resolution 0.05 --detection-budget 0 " + more);
}

void NodeTest::expect_live_is(const std::string& map) const {
  for (const char* ending : {".surfaces", ".bt"})
    EXPECT_TRUE(read(std::string("live") + ending) == read(map + ending)) << ending;
}

}  // namespace octosurf::test
