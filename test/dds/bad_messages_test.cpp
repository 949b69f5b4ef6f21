// What robots send that is broken is refused, counted and told, and the map is what it is without.
#include "dds/robot.hpp"

#include <gmock/gmock.h>
#include <limits>

namespace octosurf::test {
namespace {

using sensor_msgs::msg::dds_::CameraInfo_;
using sensor_msgs::msg::dds_::CameraInfo_PubSubType;
using sensor_msgs::msg::dds_::Image_;
using sensor_msgs::msg::dds_::Image_PubSubType;
using tf2_msgs::msg::dds_::TFMessage_;
using tf2_msgs::msg::dds_::TFMessage_PubSubType;

class BadMessages : public NodeTest {
 protected:
  template <class Support>
  static typename Support::type first(const Player& player, const std::string& topic) {
    for (const Player::Message& message : player.messages())
      if (message.topic == topic) return deserialised<Support>(message.cdr);
    throw std::out_of_range("no message on " + topic);
  }
};

TEST_F(BadMessages, AreRefusedAndNothingIsLost) {
  record();
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  Vendor careless(domain);  // a participant of its own: a topic is of one type in each
  struct RawImage : RawSupport {
    using type = std::string;
    RawImage() : RawSupport("sensor_msgs::msg::dds_::Image_") {}
  };
  Publisher<RawImage> raw(careless, "rt/camera/depth/image", Qos::reliable);
  const auto node = start({"--depth", "/camera/depth/image", "-o", "live", "--reliable", "--wait", "0.2"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status, 2)) << node->errors();
  player.play(0, 2);
  ASSERT_TRUE(wait_until([&] { return status.last().mapped() == 2; })) << node->errors();

  const auto image = first<Image_PubSubType>(player, "/camera/depth/image");
  const auto refused_after = [&](const char* what, const std::function<void()>& publish) {
    const std::uint64_t before = status.last().refused();
    publish();
    EXPECT_TRUE(wait_until([&] { return status.last().refused() == before + 1; }))
        << what << ": " << status.last().last_refusal() << node->errors();
    return status.last().last_refusal();
  };
  const auto altered = [&](const std::function<void(Image_&)>& alter) {
    Image_ bad = image;
    alter(bad);
    return [&player, bad] { player.images.publish(bad); };
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(refused_after("encoding", altered([](Image_& bad) { bad.encoding("rgb8"); })),
              HasSubstr("rgb8"));
  EXPECT_THAT(refused_after("height", altered([](Image_& bad) { bad.height(bad.height() + 1); })),
              HasSubstr("its camera has"));
  EXPECT_THAT(
      refused_after("short data", altered([](Image_& bad) { bad.data().resize(bad.data().size() - 1); })),
      HasSubstr("holds"));
  EXPECT_THAT(refused_after("huge step", altered([](Image_& bad) { bad.step(0xffffffffU); })),
              HasSubstr("rows of"));
  EXPECT_THAT(refused_after("no such frame", altered([](Image_& bad) { bad.header().frame_id("nowhere"); })),
              HasSubstr("nowhere"));
  EXPECT_THAT(refused_after("no pose at its time", altered([](Image_& bad) { bad.header().stamp().sec(1); })),
              HasSubstr("pose"));
  const std::string whole = serialised<Image_PubSubType>(image);
  refused_after("the first that is heard of this publisher", [&] {
    const std::uint64_t before = status.last().received();
    // Rarely enough that all of them have come when one has: what comes after is counted.
    EXPECT_TRUE(wait_until([&] {
      raw.publish(whole.substr(0, 8));
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      return status.last().received() > before;
    }));
  });
  for (const std::size_t size : {std::size_t{8}, std::size_t{21}, whole.size() - 1000})
    EXPECT_NE(refused_after("truncated", [&] { raw.publish(whole.substr(0, size)); }), "") << size;
  EXPECT_NE(refused_after("parameter list", [&] { raw.publish(std::string("\0\3", 2) + whole.substr(2)); }),
            "");

  const auto messages_refused_after = [&](const char* what, const std::function<void()>& publish) {
    const std::uint64_t before = status.last().messages_refused();
    publish();
    EXPECT_TRUE(wait_until([&] { return status.last().messages_refused() == before + 1; }))
        << what << ": " << node->errors();
  };
  TFMessage_ transforms = first<TFMessage_PubSubType>(player, "/tf");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  transforms.transforms()[0].transform().translation().x(nan);
  messages_refused_after("NaN in tf", [&] { player.tf.publish(transforms); });
  transforms.transforms()[0].transform().translation().x(0);
  transforms.transforms()[0].transform().rotation().w(3);
  messages_refused_after("no rotation", [&] { player.tf.publish(transforms); });
  CameraInfo_ camera = first<CameraInfo_PubSubType>(player, "/camera/depth/camera_info");
  camera.k()[0] = nan;
  messages_refused_after("NaN in CameraInfo", [&] { player.cameras.publish(camera); });

  player.play(2, 6);
  ASSERT_TRUE(wait_until([&] { return status.last().mapped() == 6; })) << node->errors();
  EXPECT_EQ(status.last().received(), 6 + status.last().refused());
  EXPECT_THAT(node->errors(), HasSubstr("refused: "));
  EXPECT_EQ(end(*node), 0) << node->errors();
  expect_live_is("offline");
}

/// A service's request that ends too early gets no answer, and the next one does.
TEST_F(BadMessages, AsRequestsLeaveTheServicesAtWork) {
  Vendor careless(domain);
  struct RawRequest : RawSupport {
    using type = std::string;
    RawRequest() : RawSupport("octosurf_msgs::srv::dds_::Save_Request_") {}
  };
  Publisher<RawRequest> raw(careless, "rq/octosurf/saveRequest", Qos::reliable);
  const auto node = start({"--depth", "/camera/depth/image", "-o", "live"});
  ASSERT_TRUE(
      spoken_until([&] { raw.publish(std::string("\0\1\0\0abc", 7)); },
                   [&] { return node->errors().find("request of /octosurf/save") != std::string::npos; }));
  SaveClient save(*vendor, "/octosurf/save");
  EXPECT_TRUE(save.call({}).success());
  EXPECT_TRUE(exists("live.surfaces"));
}

}  // namespace
}  // namespace octosurf::test
