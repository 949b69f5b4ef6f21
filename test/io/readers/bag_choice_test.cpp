// What is taken of a bag: chosen where there is no choice, else asked for.
#include "io/readers/bag_files.hpp"

#include <gmock/gmock.h>

#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* cloud_type = "sensor_msgs/msg/PointCloud2";
constexpr const char* tf_type = "tf2_msgs/msg/TFMessage";
constexpr const char* odometry_type = "nav_msgs/msg/Odometry";

McapMessage cloud(double stamp_s, const std::string& topic = "/points", const std::string& frame = "lidar") {
  return {topic, cloud_type, stamp_s, one_point(stamp_s, frame).all()};
}
McapMessage tf(double stamp_s, const std::string& parent, const std::string& child, double x) {
  return {"/tf", tf_type, stamp_s, one_transform(stamp_s, parent, child, x).all()};
}
McapMessage fixed(const std::string& parent, const std::string& child, double x) {
  return {"/tf_static", tf_type, 0.5, one_transform(0.5, parent, child, x).all()};
}
McapMessage odometry(double stamp_s, double x, const std::string& topic = "/odom",
                     const std::string& child = "base") {
  CdrBytes message;
  message.header(stamp_s, "odom").text(child).pose(x);
  for (int i = 0; i < 36 + 6 + 36; ++i) message.f64(0);
  return {topic, odometry_type, stamp_s, message.all()};
}

class BagChoice : public ScanFiles {
 protected:
  static ScanSourceOptions with(const BagOptions& choice, bool skip_bad = false) {
    ScanSourceOptions options;
    options.bag = choice;
    options.skip_bad = skip_bad;
    return options;
  }
  std::filesystem::path bag(const std::vector<McapMessage>& messages) const {
    return write("a.mcap", mcap_of(messages));
  }
  std::string refusal(const std::vector<McapMessage>& messages, const BagOptions& choice = {}) const {
    return failure({bag(messages)}, with(choice));
  }
  /// Where the scans were taken, along x.
  std::vector<double> places(const std::vector<McapMessage>& messages, const BagOptions& choice = {},
                             bool skip_bad = false) const {
    std::vector<double> all;
    for (const Scan& scan : read_all({bag(messages)}, with(choice, skip_bad)))
      all.push_back(scan.T_map_sensor.translation().x());
    return all;
  }
};

TEST_F(BagChoice, TheOnlyTopicIsTakenAndSaid) {
  const auto source = open_scans({bag({tf(1, "odom", "lidar", 4), cloud(1)})});
  EXPECT_THAT(source->notes(), ElementsAre(HasSubstr("scans: 1 message of /points (sensor_msgs/PointCloud2)"),
                                           HasSubstr("poses: tf of lidar in odom")));
  const auto scans = read_all(*source);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].points, std::vector<Eigen::Vector3f>({{1, 2, 3}}));
  EXPECT_EQ(scans[0].T_map_sensor.translation().x(), 4);
  EXPECT_EQ(scans[0].sensor, SensorKind::lidar);
}

TEST_F(BagChoice, SeveralTopicsAreListed) {
  const std::vector<McapMessage> two{tf(1, "odom", "lidar", 4), cloud(1), cloud(1.01, "/other")};
  EXPECT_THAT(refusal(two),
              AllOf(HasSubstr("2 topics with scans"), HasSubstr("/points (sensor_msgs/PointCloud2)"),
                    HasSubstr("/other"), HasSubstr("--topic")));
  BagOptions options;
  options.topics = {"/other"};
  EXPECT_THAT(places(two, options), ElementsAre(4));
  options.topics = {"/other", "/points"};
  EXPECT_THAT(places(two, options), ElementsAre(4, 4));
  options.topics = {"/tf"};
  EXPECT_THAT(refusal(two, options), AllOf(HasSubstr("no topic /tf with point clouds"), HasSubstr("/other")));
}

TEST_F(BagChoice, WhatIsMissingIsSaid) {
  EXPECT_THAT(refusal({tf(1, "odom", "lidar", 4)}), HasSubstr("no topic with point clouds or depth images"));
  EXPECT_THAT(refusal({}), HasSubstr("no topic with point clouds or depth images"));
  EXPECT_THAT(refusal({cloud(1)}), AllOf(HasSubstr("no poses"), HasSubstr("--poses FILE")));
  EXPECT_THAT(refusal({odometry(1, 7), cloud(1)}),
              AllOf(HasSubstr("/points at 1.000000000"), HasSubstr("tf has no frame 'lidar'")));
  EXPECT_THAT(refusal({odometry(1, 7), odometry(1, 8, "/other"), cloud(1)}),
              AllOf(HasSubstr("2 topics have poses"), HasSubstr("/odom (nav_msgs/Odometry)"),
                    HasSubstr("--pose-topic")));
}

TEST_F(BagChoice, LargeMessagesOfAnUnknownTypeAreNamed) {
  const std::vector<McapMessage> packets{
      tf(1, "odom", "lidar", 4),
      {"/packets", "velodyne_msgs/msg/VelodyneScan", 1, std::string(1300, '\0')},
      {"/imu", "sensor_msgs/msg/Imu", 1, std::string(324, '\0')}};
  EXPECT_THAT(refusal(packets), AllOf(HasSubstr("large: /packets (velodyne_msgs/VelodyneScan)"),
                                      ::testing::Not(HasSubstr("/imu")), HasSubstr("PointCloud2")));
}

/// A cloud without fields, as drivers send one before the first revolution, without frame and time, too.
McapMessage empty_cloud(double stamp_s, const std::string& frame, std::uint32_t width = 0) {
  CdrBytes message;
  message.header(stamp_s, frame).u32(1).u32(width).u32(0).u8(0).u32(0).u32(0).bytes("").u8(1);
  return {"/points", cloud_type, 1.5, message.all()};
}

TEST_F(BagChoice, MessagesWithoutPointsAreNoScans) {
  const auto source =
      open_scans({bag({empty_cloud(0, ""), tf(1, "odom", "lidar", 4), tf(2, "odom", "lidar", 5), cloud(1),
                       empty_cloud(1.5, "lidar"), cloud(2)})});
  EXPECT_THAT(source->notes().front(), HasSubstr("2 messages of /points (sensor_msgs/PointCloud2), 2 more "
                                                 "without points"));
  EXPECT_EQ(read_all(*source).size(), 2U);
  EXPECT_THAT(refusal({tf(1, "odom", "lidar", 4), empty_cloud(1, "lidar")}),
              HasSubstr("no message of /points (sensor_msgs/PointCloud2) holds a point"));
  EXPECT_THAT(refusal({tf(1, "odom", "lidar", 4), empty_cloud(1, "lidar", 7)}),
              HasSubstr("without one each of x, y and z"));
}

TEST_F(BagChoice, BadSamplesOfTfAreLeftOutAndTold) {
  std::vector<McapMessage> messages{fixed("base", "arm", 1)};
  for (int i = 0; i < 5; ++i) messages.push_back(tf(1 + 0.02 * i, "odom", "lidar", i));
  const auto bad = [](const std::string& parent, const std::string& child, double x, double qw) {
    return McapMessage{"/tf", tf_type, 1.05,
                       CdrBytes().u32(1).header(1.05, parent).text(child).pose(x, qw).all()};
  };
  messages.push_back(bad("odom", "lidar", 90, 1.014));
  messages.push_back(bad("base", "arm", 0, 0));
  messages.push_back(tf(1.08, "base", "arm", 0));
  messages.push_back(cloud(1.05));
  const auto source = open_scans({bag(messages)});
  EXPECT_THAT(source->notes().back(), AllOf(HasSubstr("poses: 2 samples left out"), HasSubstr("1 %")));
  const auto scans = read_all(*source);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_NEAR(scans[0].T_map_sensor.translation().x(), 2.5, 1e-9);
}

TEST_F(BagChoice, LivoxMessagesAreClouds) {
  struct Point {
    float x;
    std::uint8_t tag;
  };
  // Return numbers in bits 4 and 5; noise by place (0x01, 0x02) and by intensity (0x04, 0x08); 3 is no noise.
  const std::vector<Point> points{{1, 0x00}, {2, 0x10}, {0, 0x10}, {4, 0x11}, {5, 0x02},
                                  {6, 0x04}, {7, 0x28}, {8, 0x13}, {9, 0x0c}};
  for (const std::string type : {"livox_ros_driver2/msg/CustomMsg", "livox_ros_driver/msg/CustomMsg"}) {
    CdrBytes message;
    message.header(1, "lidar").u64(1000000000);
    message.u32(9).u8(0).u8(0).u8(0).u8(0).u32(9);
    for (const Point& p : points) message.u32(1000).f32(p.x).f32(0).f32(0).u8(30).u8(p.tag).u8(2);
    const auto scans = read_all({bag({tf(1, "odom", "lidar", 4), {"/livox/lidar", type, 1, message.all()}})});
    ASSERT_EQ(scans.size(), 1U);
    std::vector<float> x;
    for (const Eigen::Vector3f& point : scans[0].points)
      if (point.allFinite()) x.push_back(point.x());
    EXPECT_EQ(x, (std::vector<float>{1, 2, 8, 9}));
    EXPECT_EQ(scans[0].points.size(), 9U);
    EXPECT_EQ(scans[0].sensor, SensorKind::lidar);
  }
}

TEST_F(BagChoice, TheMapsFrameIsMapOrTheRoot) {
  const std::vector<McapMessage> chain{fixed("base", "lidar", 0.5), tf(1, "earth", "map", 1000),
                                       tf(1, "map", "odom", 10), tf(1, "odom", "base", 1), cloud(1)};
  EXPECT_THAT(places(chain), ElementsAre(11.5));
  BagOptions options;
  options.fixed_frame = "odom";
  EXPECT_THAT(places(chain, options), ElementsAre(1.5));
  options.fixed_frame = "earth";
  EXPECT_THAT(places(chain, options), ElementsAre(1011.5));
  options.fixed_frame = "moon";
  EXPECT_THAT(refusal(chain, options), HasSubstr("tf has no frame moon"));
}

TEST_F(BagChoice, APoseTopicIsGoneOnFromByTf) {
  const std::vector<McapMessage> messages{fixed("base", "lidar", 0.5), odometry(1, 7), cloud(1)};
  EXPECT_THAT(places(messages), ElementsAre(7.5));  // tf does not move it
  BagOptions options;
  options.pose_frame = "lidar";
  EXPECT_THAT(places(messages, options), ElementsAre(7));
  std::vector<McapMessage> both = messages;
  both.push_back(tf(1, "map", "base", 3));
  EXPECT_THAT(places(both), ElementsAre(3.5));
  options = {};
  options.pose_topic = "/odom";
  EXPECT_THAT(places(both, options), ElementsAre(7.5));
  both.push_back(odometry(1, 8, "/other"));
  options.pose_topic = "/others";
  EXPECT_THAT(refusal(both, options),
              AllOf(HasSubstr("no topic /others with poses"), HasSubstr("/odom"), HasSubstr("/other")));
}

TEST_F(BagChoice, PosesWithoutAFrameAreTheOneSensors) {
  const McapMessage pose{"/pose", "geometry_msgs/msg/PoseStamped", 1,
                         CdrBytes().header(1, "world").pose(6).all()};
  EXPECT_THAT(places({pose, cloud(1)}), ElementsAre(6));
  const std::vector<McapMessage> two{pose, fixed("base", "left", 0.5), fixed("base", "right", -0.5),
                                     cloud(1, "/left", "left"), cloud(1, "/right", "right")};
  BagOptions options;
  options.topics = {"/left", "/right"};
  EXPECT_THAT(refusal(two, options), HasSubstr("name no frame, and the scans are of several"));
  options.pose_frame = "base";
  EXPECT_THAT(places(two, options), ElementsAre(6.5, 5.5));
}

TEST_F(BagChoice, ASelfBoxStandsInAFrameOfTf) {
  // The point (1, 2, 3) of the lidar's is (1.5, 2, 3) of the leg's, which moves.
  const std::vector<McapMessage> messages{tf(1, "odom", "base", 4), fixed("base", "lidar", 0.5),
                                          tf(1, "base", "leg", 0), cloud(1)};
  ScanSourceOptions options;
  for (const double to : {1.4, 1.6}) {
    options.self_boxes = {{Eigen::AlignedBox3d(Eigen::Vector3d(-1, 1, 2), Eigen::Vector3d(to, 3, 4)), "leg"}};
    const auto scans = read_all({bag(messages)}, options);
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_EQ(scans[0].points[0].allFinite(), to < 1.5);
  }
  options.self_boxes[0].frame = "tail";
  EXPECT_THAT(failure({bag(messages)}, options), AllOf(HasSubstr("--self-box tail"), HasSubstr("tail")));
}

class RegisteredClouds : public BagChoice {
 protected:
  void expect_from_the_robot(const std::vector<McapMessage>& messages, const BagOptions& choice = {},
                             double place = 7) const {
    const auto source = open_scans({bag(messages)}, with(choice));
    EXPECT_THAT(source->notes().back(), HasSubstr("their rays start at"));
    const auto scans = read_all(*source);
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_EQ(scans[0].T_map_sensor.translation().x(), place);
    EXPECT_EQ(scans[0].points, std::vector<Eigen::Vector3f>({{1 - 7, 2, 3}}));
  }
};

TEST_F(RegisteredClouds, AreSeenFromTheRobotsPlace) {
  const McapMessage registered = cloud(1, "/cloud_registered", "odom");
  expect_from_the_robot({odometry(1, 7), registered});
  expect_from_the_robot({tf(1, "odom", "base", 7), registered});
  expect_from_the_robot({tf(1, "odom", "base", 7), odometry(1, 7), registered});
  expect_from_the_robot({tf(1, "map", "odom", 0), tf(1, "odom", "base", 7), registered});
  expect_from_the_robot({tf(1, "lio", "base", 7), cloud(1, "/cloud_registered", "lio")});
  BagOptions choice;
  choice.pose_topic = "/odom";
  expect_from_the_robot({tf(1, "odom", "base", 5), odometry(1, 7), registered}, choice);
  choice.pose_topic.reset();
  choice.pose_frame = "bob";
  expect_from_the_robot({tf(1, "odom", "alice", 5), tf(1, "odom", "bob", 7), registered}, choice);
  // Moved by the map's frame.
  expect_from_the_robot({tf(1, "map", "odom", 100), tf(1, "odom", "base", 7), registered}, {}, 107);
}

TEST_F(RegisteredClouds, OfARobotThatIsNotFoundAreRefused) {
  const McapMessage registered = cloud(1, "/cloud_registered", "odom");
  EXPECT_THAT(refusal({tf(1, "map", "odom", 7), registered}),
              AllOf(HasSubstr("in frame 'odom', which is no sensor's"), HasSubstr("--pose-frame")));
  EXPECT_THAT(refusal({tf(1, "odom", "alice", 5), tf(1, "odom", "bob", 7), registered}),
              HasSubstr("--pose-frame"));
  BagOptions choice;
  choice.fixed_frame = "map";
  EXPECT_THAT(places({tf(1, "map", "odom", 7), registered}, choice), ElementsAre(7));
}

TEST_F(BagChoice, AFrameInWhichALegMovesIsASensors) {
  EXPECT_THAT(places({tf(1, "base_link", "leg", 7), cloud(1, "/points", "base_link")}), ElementsAre(0));
}

TEST_F(BagChoice, PosesAreInterpolatedWithinTheGap) {
  const std::vector<McapMessage> messages{odometry(1, 1, "/odom", "lidar"),
                                          odometry(1.2, 2, "/odom", "lidar"),
                                          odometry(1.6, 4, "/odom", "lidar"), cloud(1.05), cloud(1.4)};
  EXPECT_THAT(refusal(messages),
              AllOf(HasSubstr("/points at 1.400000000: no pose on /odom at its time: its neighbours "
                              "in time are 0.400 s apart"),
                    HasSubstr("--skip-bad"), HasSubstr("--max-pose-gap")));
  EXPECT_THAT(places(messages, {}, true), ElementsAre(::testing::DoubleNear(1.25, 1e-9)));
  ScanSourceOptions options;
  options.max_pose_gap_s = 0.5;
  EXPECT_EQ(read_all({bag(messages)}, options).size(), 2U);
}

TEST_F(BagChoice, ScansComeInTheOrderOfTheirHeaders) {
  std::vector<McapMessage> messages{fixed("map", "lidar", 0), cloud(3), cloud(1), cloud(2)};
  std::vector<double> stamps;
  for (const Scan& scan : read_all({bag(messages)})) stamps.push_back(scan.stamp_s);
  EXPECT_THAT(stamps, ElementsAre(1, 2, 3));
  messages.push_back({"/points", cloud_type, 2.5, one_point(0, "lidar").all()});  // its driver has no clock
  stamps.clear();
  for (const Scan& scan : read_all({bag(messages)})) stamps.push_back(scan.stamp_s);
  EXPECT_THAT(stamps, ElementsAre(1, 2, 2.5, 3));
}

TEST_F(BagChoice, DamageIsToldOrSkipped) {
  const std::vector<McapMessage> scan{
      fixed("map", "lidar", 0), cloud(1), {"/points", cloud_type, 2, "nonsense"}, cloud(3)};
  EXPECT_THAT(refusal(scan), AllOf(HasSubstr("/points at 2.000000000"), HasSubstr("not CDR")));
  EXPECT_EQ(places(scan, {}, true).size(), 2U);
  const std::vector<McapMessage> pose{fixed("map", "lidar", 0), {"/tf", tf_type, 2, "nonsense"}, cloud(3)};
  EXPECT_THAT(refusal(pose), AllOf(HasSubstr("a.mcap /tf: message 1 not CDR"), HasSubstr("--skip-bad")));
  EXPECT_EQ(places(pose, {}, true).size(), 1U);
}

McapMessage image(double stamp_s, const std::string& topic, const std::string& encoding) {
  const std::string pixels =
      encoding == "rgb8" ? std::string(6, 'x') : bytes_of(std::uint16_t{1000}, std::uint16_t{2000});
  CdrBytes message;
  message.header(stamp_s, "camera").u32(1).u32(2).text(encoding).u8(0);
  message.u32(static_cast<std::uint32_t>(pixels.size())).bytes(pixels);
  return {topic, "sensor_msgs/msg/Image", stamp_s, message.all()};
}
McapMessage camera(const std::string& topic, double focal_length, double distortion = 0) {
  CdrBytes info;
  info.header(1, "camera").u32(1).u32(2).text("plumb_bob").u32(1).f64(distortion);
  const double K = focal_length, P = 2 * focal_length;
  for (const double f : {K, 0., 0., 0., K, 0., 0., 0., 1.}) info.f64(f);
  for (int i = 0; i < 9; ++i) info.f64(0);
  for (const double f : {P, 0., 0., 0., 0., P, 0., 0., 0., 0., 1., 0.}) info.f64(f);
  for (const std::uint32_t zero : {0, 0, 0, 0, 0, 0}) info.u32(zero);  // binning, roi
  return {topic, "sensor_msgs/msg/CameraInfo", 1, info.all()};
}

/// What a node receives one by one is read as out of a bag.
TEST_F(BagChoice, MessagesThatComeOneByOneAreReadAlike) {
  const McapMessage info = camera("/a/camera_info", 2), depth = image(1, "/a/image", "16UC1");
  const auto cdr = MessageEncoding::cdr;
  const Scan expected = *open_scans({bag({fixed("map", "camera", 0), info, depth})})->next();
  const ReceivedScan received = scan_from_depth(depth.bytes, info.bytes, cdr, "here");
  EXPECT_EQ(received.scan.points, expected.points);
  EXPECT_EQ(received.scan.points.size(), 2U);
  EXPECT_EQ(received.scan.sensor, expected.sensor);
  EXPECT_EQ(received.frame, "camera");
  EXPECT_EQ(received.stamp_ns, 1000000000);
  EXPECT_EQ(scan_from_depth(depth.bytes, info.bytes, cdr, "here", true).scan.points[1].x() * 2,
            received.scan.points[1].x());
  const ReceivedScan cloud = scan_from_cloud(one_point(5, "lidar").all(), cdr, "here");
  EXPECT_EQ(cloud.scan.points, (std::vector<Eigen::Vector3f>{{1, 2, 3}}));
  EXPECT_EQ(cloud.scan.sensor, SensorKind::lidar);
  EXPECT_EQ(cloud.frame, "lidar");

  const auto refused = [](const auto& read) { return failure(Error::Kind::data, read); };
  const std::string uncalibrated = camera("", 0).bytes;
  EXPECT_THAT(refused([&] { scan_from_depth(depth.bytes, uncalibrated, cdr, "here"); }),
              AllOf(HasSubstr("here: "), HasSubstr("not calibrated")));
  EXPECT_THAT(refused([&] { require_camera(uncalibrated, cdr, "here"); }),
              AllOf(HasSubstr("here: "), HasSubstr("not calibrated")));
  EXPECT_NO_THROW(require_camera(info.bytes, cdr, "here"));
  EXPECT_THAT(refused([&] { scan_from_depth(depth.bytes, depth.bytes, cdr, "here"); }), HasSubstr("here: "));
  EXPECT_THAT(refused([&] { scan_from_cloud(depth.bytes, cdr, "here"); }), HasSubstr("here: "));
  EXPECT_THAT(refused([&] { scan_from_cloud("", MessageEncoding::ros1, "here"); }), HasSubstr("too early"));
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), stretched(2, 0, 0, 0);
  EXPECT_TRUE(pose_from_transform({1, 2, 3}, q, "here").linear().isApprox(q.toRotationMatrix(), 1e-15));
  EXPECT_THAT(refused([&] { pose_from_transform({0, 0, 0}, stretched, "here"); }), HasSubstr("here"));
  EXPECT_THAT(refused([&] { pose_from_transform({std::nan(""), 0, 0}, q, "here"); }), HasSubstr("here"));
}

TEST(ImageTopics, TellTheirCameraAndWhetherTheyAreRectified) {
  EXPECT_EQ(camera_info_topic("/camera/depth/image"), "/camera/depth/camera_info");
  EXPECT_EQ(camera_info_topic("/camera/depth/image/compressedDepth", true), "/camera/depth/camera_info");
  EXPECT_EQ(camera_info_topic("/image"), "/camera_info");
  EXPECT_EQ(camera_info_topic("image"), "camera_info");
  EXPECT_EQ(camera_info_topic("image/compressedDepth", true), "camera_info");
  EXPECT_TRUE(is_rectified("/camera/depth/image_rect_raw"));
  EXPECT_FALSE(is_rectified("/camera/depth/image_raw"));
}

TEST_F(BagChoice, PicturesAreNoDepth) {
  const std::vector<McapMessage> messages{fixed("map", "camera", 0), camera("/a/camera_info", 1),
                                          image(1, "/a/color", "rgb8"), image(1, "/a/depth", "16UC1")};
  const auto source = open_scans({bag(messages)});
  EXPECT_THAT(source->notes()[0], HasSubstr("/a/depth"));
  EXPECT_THAT(source->notes()[1], HasSubstr("camera: /a/camera_info (its K)"));
  const auto scans = read_all(*source);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].points, std::vector<Eigen::Vector3f>({{0, 0, 1}, {2, 0, 2}}));
  EXPECT_EQ(scans[0].sensor, SensorKind::depth_camera);
}

TEST_F(BagChoice, ACameraIsFoundByItsNamespaceOrName) {
  const std::vector<McapMessage> messages{fixed("map", "camera", 0), camera("/b/camera_info", 1, 0.1),
                                          image(1, "/a/depth", "16UC1")};
  EXPECT_THAT(refusal(messages),
              AllOf(HasSubstr("no CameraInfo on /a/camera_info"),
                    HasSubstr("/b/camera_info (sensor_msgs/CameraInfo)"), HasSubstr("--info-topic")));
  ScanSourceOptions options;
  options.bag.info_topic = "/b/camera_info";
  const auto source = open_scans({bag(messages)}, options);
  EXPECT_THAT(source->notes()[2], HasSubstr("distortion"));
}

TEST_F(BagChoice, RectifiedImagesHaveTheProjectionMatrixAndNoneIsUncalibrated) {
  const auto seen = [](double focal_length, const char* topic) -> std::vector<McapMessage> {
    return {fixed("map", "camera", 0), camera("/a/camera_info", focal_length), image(1, topic, "16UC1")};
  };
  const auto scans = read_all({bag(seen(1, "/a/image_rect"))});
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].points[1], Eigen::Vector3f(1, 0, 2));
  EXPECT_THAT(refusal(seen(0, "/a/depth")), HasSubstr("not calibrated"));
}

TEST_F(BagChoice, TwoSourcesOfPosesAreRefused) {
  BagOptions choice;
  choice.pose_topic = "/odom";
  choice.fixed_frame = "map";
  failure(Error::Kind::usage, [&] { open_scans({bag({odometry(1, 7), cloud(1)})}, with(choice)); });
}

}  // namespace
}  // namespace octosurf::test
