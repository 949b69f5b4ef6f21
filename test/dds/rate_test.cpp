// A depth camera's full rate: 640×480 at 30 Hz for two seconds. Counted is what reaches the node's queue.
#include "dds/robot.hpp"

#include <chrono>
#include <iostream>
#include <thread>

namespace octosurf::test {
namespace {

constexpr int images = 60;

class Rate : public NodeTest {
 protected:
  /// Publishes; returns what the node tells when nothing comes any more.
  octosurf_msgs::msg::dds_::Status_ publish_images(Qos qos, const std::vector<std::string>& options) {
    Publisher<sensor_msgs::msg::dds_::Image_PubSubType> publisher(*vendor, "rt/camera/depth/image", qos,
                                                                  images);
    std::vector<std::string> arguments{"--depth", "/camera/depth/image", "-o", "live"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto node = start(arguments);
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    EXPECT_TRUE(wait_until([&] { return status.last().scan_publishers() == 1; })) << node->errors();
    sensor_msgs::msg::dds_::Image_ image;
    image.header().frame_id("camera");
    image.width(640);
    image.height(480);
    image.step(1280);
    image.encoding("16UC1");
    image.data(std::vector<std::uint8_t>(614400, 1));
    // The first one to be heard does not count.
    EXPECT_TRUE(
        spoken_until([&] { publisher.publish(image); }, [&] { return status.last().received() > 0; }));
    const auto first = status.last().received();
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < images; ++i) {
      std::this_thread::sleep_until(begin + i * std::chrono::microseconds(33333));
      image.header().stamp().sec(i + 1);
      EXPECT_TRUE(publisher.publish(image));
    }
    octosurf_msgs::msg::dds_::Status_ last;
    int same = 0;  // for half a second, or until all has come
    wait_until([&] {
      const auto now = status.last();
      same = now.received() == last.received() ? same + 1 : 0;
      last = now;
      return now.received() == first + images || same == 250;
    });
    last.received(last.received() - first);
    std::cout << "received " << last.received() << " of " << images << ", told to be lost " << last.lost()
              << ", dropped " << last.dropped() << "\n";
    return last;
  }
};

TEST_F(Rate, OfADepthCameraArrivesWhole) {
  const auto status = publish_images(Qos::reliable, {"--reliable", "--wait", "0"});
  EXPECT_EQ(status.received(), static_cast<std::uint64_t>(images));
  EXPECT_EQ(status.dropped(), 0u);
}

TEST_F(Rate, BestEffortTellsOfWhatIsLost) {
  const auto status = publish_images(Qos::best_effort, {"--wait", "0"});
  EXPECT_GT(status.received(), 0u);
  EXPECT_LE(status.received() + status.lost(), static_cast<std::uint64_t>(images));
  EXPECT_EQ(status.dropped(), 0u);
}

TEST_F(Rate, BeyondTheQueueDropsAndTells) {
  // Of a queue that holds one image all but the last make way while the mapper waits for a pose of the first.
  const auto status = publish_images(Qos::reliable, {"--reliable", "--queue", "1", "--wait", "60"});
  EXPECT_EQ(status.received(), static_cast<std::uint64_t>(images));
  EXPECT_GE(status.dropped(), static_cast<std::uint64_t>(images - 1));
  EXPECT_EQ(status.waiting(), 1u);
}

}  // namespace
}  // namespace octosurf::test
