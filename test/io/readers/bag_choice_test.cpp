// What is taken of a bag: chosen where there is no choice, else asked for.
#include "io/readers/bag_files.hpp"
#include "io/readers/sensor_messages.hpp"

#include <octosurf/ros_messages.hpp>

namespace octosurf::test {
namespace {

McapMessage odometry(double stamp_s, double x, const std::string& topic = "/odom",
                     const std::string& child = "base") {
  CdrBytes message;
  message.header(stamp_s, "odom").text(child).pose(x);
  for (int i = 0; i < 36 + 6 + 36; ++i) message.f64(0);
  return {topic, "nav_msgs/msg/Odometry", stamp_s, message.all()};
}

class BagChoice : public ScanFiles {
 protected:
  fs::path bag(const std::vector<McapMessage>& messages) const { return write("a.mcap", mcap_of(messages)); }
  std::vector<Scan> scans(const std::vector<McapMessage>& messages, const BagOptions& choice = {},
                          bool skip_bad = false) const {
    return read_all({bag(messages)}, {.bag = choice, .skip_bad = skip_bad});
  }
  std::string refusal(const std::vector<McapMessage>& messages, const BagOptions& choice = {}) const {
    return failure({bag(messages)}, {.bag = choice});
  }
  std::vector<double> places(const std::vector<McapMessage>& messages, const BagOptions& choice = {},
                             bool skip_bad = false) const {
    return test::places(scans(messages, choice, skip_bad));
  }
};

TEST_F(BagChoice, SeveralTopicsAreListed) {
  const std::vector<McapMessage> two{tf(1, "odom", "lidar", 4), cloud(1), cloud(1.01, "/other")};
  EXPECT_THAT(refusal(two),
              says("2 topics with scans", "/points (sensor_msgs/PointCloud2)", "/other", "--topic"));
  EXPECT_THAT(places(two, {.topics = {"/other"}}), ElementsAre(4));
  EXPECT_THAT(places(two, {.topics = {"/other", "/points"}}), ElementsAre(4, 4));
  EXPECT_THAT(refusal(two, {.topics = {"/tf"}}), says("no topic /tf with point clouds", "/other"));
}

/// A cloud without fields, as drivers send one before the first revolution, without frame and time, too.
McapMessage empty_cloud(double stamp_s, const std::string& frame, std::uint32_t width = 0) {
  CdrBytes message;
  message.header(stamp_s, frame).u32(1).u32(width).u32(0).u8(0).u32(0).u32(0).bytes("").u8(1);
  return {"/points", "sensor_msgs/msg/PointCloud2", 1.5, message.all()};
}

/// On /at, as if of poses of such times at x = 10 times that: PoseStamped, or a Path of many.
McapMessage stamped(const std::string& type, const std::vector<double>& times, double x_per_s = 10) {
  CdrBytes message;
  if (type == "Path") message.header(times.back(), "world").u32(static_cast<std::uint32_t>(times.size()));
  for (const double s : times) message.header(type == "Path" ? s : times[0], "world").pose(x_per_s * s);
  return {"/at", (type == "Path" ? "nav_msgs/msg/" : "geometry_msgs/msg/") + type, times.back(),
          message.all()};
}

TEST_F(BagChoice, APathsPosesAreThoseOfItsLastMessages) {
  // A later message corrects what an earlier one said; of one without times the last is of its header's.
  EXPECT_THAT(places({stamped("Path", {1}), stamped("Path", {1, 1.2}, 5), cloud(1), cloud(1.1)}),
              ElementsAre(5, DoubleNear(5.5, 1e-9)));
  EXPECT_THAT(places({at(1.3, stamped("Path", {1, 1.2})), at(1.3, cloud(1))}, {.recorded_stamps = true}),
              ElementsAre(12));
  McapMessage untimed = stamped("Path", {0, 0});
  untimed.bytes.replace(4, 4, std::string("\1\0\0\0", 4));
  EXPECT_THAT(stamps(scans({untimed, cloud(1)})), ElementsAre(1));
}

TEST_F(BagChoice, WhatIsMissingIsSaid) {
  const McapMessage pose = tf(1, "odom", "lidar", 4);
  const auto packets = [](const char* type) {
    return McapMessage{"/packets", type, 1, std::string(1300, '\0')};
  };
  for (const auto& [messages, words] :
       std::vector<std::pair<std::vector<McapMessage>, std::vector<const char*>>>{
           {{pose}, {"no topic with point clouds or depth images"}},
           {{}, {"no topic with point clouds or depth images"}},
           {{cloud(1)}, {"no poses", "--poses FILE"}},
           {{odometry(1, 7), cloud(1)},
            {"/points at 1.000000000", "tf has no frame 'lidar', nor any", "--pose-frame names", "in-map"}},
           {{odometry(1, 7), fixed("car", "lidar", 1), cloud(1)},
            {"tf has no frame 'base', but car, lidar; --pose-frame names whose poses a topic has"}},
           {{stamped("TwistStamped", {1}), cloud(1)}, {"no poses", "/at (geometry_msgs/TwistStamped)"}},
           {{odometry(1, 7), odometry(1, 8, "/other"), cloud(1)},
            {"2 topics have poses", "/odom (nav_msgs/Odometry)", "--pose-topic"}},
           {{pose, packets("velodyne_msgs/msg/VelodyneScan")},
            {"/packets (velodyne_msgs/VelodyneScan)", "velodyne_pointcloud turns them into PointCloud2"}},
           {{pose, packets("ouster_sensor_msgs/msg/PacketMsg")}, {"packets", "os_cloud"}},
           {{pose, packets("hesai_ros_driver/msg/UdpFrame")}, {"packets", "hesai_ros_driver"}},
           {{pose, packets("livox_interfaces/msg/PacketMsg")}, {"packets", "livox_ros_driver2"}},
           {{pose, empty_cloud(1, "lidar")},
            {"no message of /points (sensor_msgs/PointCloud2) holds a point"}},
           {{pose, empty_cloud(1, "lidar", 7)}, {"without one each of x, y and z"}}})
    for (const char* word : words) EXPECT_THAT(refusal(messages), HasSubstr(word));
  EXPECT_THAT(refusal({pose, packets("sensor_msgs/msg/Imu")}), Not(HasSubstr("packets")));
}

TEST_F(BagChoice, MessagesWithoutPointsAreNoScans) {
  const auto source =
      open_scans({bag({empty_cloud(0, ""), tf(1, "odom", "lidar", 4), tf(2, "odom", "lidar", 5), cloud(1),
                       empty_cloud(1.5, "lidar"), cloud(2)})});
  EXPECT_THAT(source->notes().front(),
              says("2 messages of /points (sensor_msgs/PointCloud2), 2 more without points"));
  EXPECT_EQ(read_all(*source).size(), 2U);
}

TEST_F(BagChoice, BadSamplesOfTfAreLeftOutAndTold) {
  std::vector<McapMessage> messages{fixed("base", "arm", 1), tf(1.08, "base", "arm", 0), cloud(1.05)};
  for (int i = 0; i < 5; ++i) messages.push_back(tf(1 + 0.02 * i, "odom", "lidar", i));
  const auto add_bad = [&](const std::string& parent, const std::string& child, double x, double qw) {
    messages.push_back(tf(1.05, parent, child, x));
    messages.back().bytes = CdrBytes().u32(1).header(1.05, parent).text(child).pose(x, qw).all();
  };
  add_bad("odom", "lidar", 90, 1.014);
  add_bad("base", "arm", 0, 0);
  const auto source = open_scans({bag(messages)});
  EXPECT_THAT(source->notes().back(), says("poses: 2 samples left out", "1 %"));
  EXPECT_THAT(test::places(read_all(*source)), ElementsAre(DoubleNear(2.5, 1e-9)));
}

TEST_F(BagChoice, LivoxMessagesAreClouds) {
  // Return numbers in bits 4 and 5; noise by place (0x01, 0x02) and by intensity (0x04, 0x08); 3 is no noise.
  const std::vector<std::pair<float, std::uint8_t>> x_and_tag{
      {1, 0x00}, {2, 0x10}, {0, 0x10}, {4, 0x11}, {5, 0x02}, {6, 0x04}, {7, 0x28}, {8, 0x13}, {9, 0x0c}};
  for (const std::string type : {"livox_ros_driver2/msg/CustomMsg", "livox_ros_driver/msg/CustomMsg"}) {
    CdrBytes message;
    message.header(1, "lidar").u64(1000000000);
    message.u32(9).u8(0).u8(0).u8(0).u8(0).u32(9);
    for (const auto& [x, tag] : x_and_tag) message.u32(1000).f32(x).f32(0).f32(0).u8(30).u8(tag).u8(2);
    const auto read = scans({tf(1, "odom", "lidar", 4), {"/livox/lidar", type, 1, message.all()}});
    ASSERT_EQ(read.size(), 1U);
    std::vector<float> found;
    for (const Eigen::Vector3f& point : read[0].points)
      if (point.allFinite()) found.push_back(point.x());
    EXPECT_THAT(found, ElementsAre(1, 2, 8, 9));
    EXPECT_EQ(read[0].points.size(), 9U);
    EXPECT_EQ(read[0].sensor, SensorKind::lidar);
  }
}

TEST_F(BagChoice, TheMapsFrameIsMapOrTheRoot) {
  const std::vector<McapMessage> chain{fixed("base", "lidar", 0.5), tf(1, "earth", "map", 1000),
                                       tf(1, "map", "odom", 10), tf(1, "odom", "base", 1), cloud(1)};
  EXPECT_THAT(places(chain), ElementsAre(11.5));
  EXPECT_THAT(places(chain, {.fixed_frame = "odom"}), ElementsAre(1.5));
  EXPECT_THAT(places(chain, {.fixed_frame = "earth"}), ElementsAre(1011.5));
  EXPECT_THAT(refusal(chain, {.fixed_frame = "moon"}),
              says("tf has no frame 'moon', but base, lidar, earth"));
}

TEST_F(BagChoice, APoseTopicIsGoneOnFromByTf) {
  std::vector<McapMessage> messages{fixed("base", "lidar", 0.5), odometry(1, 7), cloud(1)};
  EXPECT_THAT(places(messages), ElementsAre(7.5));  // tf does not move it
  EXPECT_THAT(places(messages, {.pose_frame = "lidar"}), ElementsAre(7));
  messages.push_back(tf(1, "map", "base", 3));
  EXPECT_THAT(places(messages), ElementsAre(3.5));
  EXPECT_THAT(places(messages, {.pose_topic = "/odom"}), ElementsAre(7.5));
  messages.push_back(odometry(1, 8, "/other"));
  EXPECT_THAT(refusal(messages, {.pose_topic = "/others"}),
              says("no topic /others with poses", "/odom", "/other"));
  failure(Error::Kind::usage, [&] { scans(messages, {.pose_topic = "/odom", .fixed_frame = "map"}); });
}

TEST_F(BagChoice, PosesWithoutAFrameAreTheOneSensors) {
  const McapMessage pose = stamped("PoseStamped", {1}, 6);
  EXPECT_THAT(places({pose, cloud(1)}), ElementsAre(6));
  const std::vector<McapMessage> two{pose, fixed("base", "left", 0.5), fixed("base", "right", -0.5),
                                     cloud(1, "/left", "left"), cloud(1, "/right", "right")};
  BagOptions options{.topics = {"/left", "/right"}};
  EXPECT_THAT(refusal(two, options), says("name no frame, and the scans are of several"));
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
    EXPECT_EQ(read_all({bag(messages)}, options).at(0).points[0].allFinite(), to < 1.5);
  }
  options.self_boxes[0].frame = "tail";
  EXPECT_THAT(failure({bag(messages)}, options),
              says("--self-box tail: tf has no frame 'tail', but odom, base"));
}

TEST_F(BagChoice, CloudsInTheMapsFrameAreSeenFromTheSensor) {
  const McapMessage registered = cloud(1, "/cloud_registered", "odom"), base = tf(1, "odom", "base", 7);
  const std::vector<McapMessage> robot{base, registered}, moved{tf(1, "map", "odom", 100), base, registered};
  // The poses' parent frame is the clouds'; or the frame that the sensor is looked up in.
  for (const auto& [place, messages, choice] :
       std::vector<std::tuple<double, std::vector<McapMessage>, BagOptions>>{
           {7, {odometry(1, 7), registered}, {}},
           {7, {tf(1, "odom", "base", 5), odometry(1, 7), registered}, {.pose_topic = "/odom"}},
           {7, robot, {.pose_frame = "base"}},
           {107, moved, {.pose_frame = "base"}}}) {
    const auto source = open_scans({bag(messages)}, {.bag = choice});
    EXPECT_THAT(source->notes().back(), says("their rays start at"));
    const auto all = read_all(*source);
    EXPECT_THAT(test::places(all), ElementsAre(place));
    EXPECT_THAT(all.at(0).points, ElementsAre(Eigen::Vector3f(1 - 7, 2, 3)));
  }
  EXPECT_THAT(refusal(robot), says("in the map's frame 'odom', and nothing says", "--pose-frame"));
  EXPECT_THAT(refusal(robot, {.fixed_frame = "odom"}), says("--pose-frame"));
  EXPECT_THAT(places(robot, {.pose_frame = "odom"}), ElementsAre(0)) << "its origin, as stated";
  EXPECT_THAT(places({fixed("odom", "gate", 7), registered}), ElementsAre(0)) << "nothing moves in it";
  for (const McapMessage& mover : {odometry(1, 7), base})  // the clouds' frame is another than the poses'
    for (const char* const frame : {"odom", "world"}) {
      const ScanSourceOptions options{.pose_form = PoseForm::in_map, .bag = {.pose_frame = "base"}};
      const auto all = read_all({bag({mover, cloud(1, "/cloud_registered", frame)})}, options);
      EXPECT_THAT(test::places(all), ElementsAre(7));
      EXPECT_THAT(all.at(0).points, ElementsAre(Eigen::Vector3f(1 - 7, 2, 3)));
    }
}

TEST_F(BagChoice, ACloudInAnOpticalFrameIsACameras) {
  const std::string frame = "camera_depth_optical_frame";
  const std::vector<McapMessage> messages{fixed("map", frame, 0), cloud(1, "/points", frame)};
  EXPECT_EQ(scans(messages).at(0).sensor, SensorKind::depth_camera);
  EXPECT_EQ(read_all({bag(messages)}, {.sensor = SensorKind::lidar}).at(0).sensor, SensorKind::lidar);
  EXPECT_EQ(scan_from_cloud(messages[1].bytes, MessageEncoding::cdr, "here").scan.sensor,
            SensorKind::depth_camera);
}

TEST_F(BagChoice, PosesAreInterpolatedWithinTheGap) {
  const std::vector<McapMessage> messages{odometry(1, 1, "/odom", "lidar"),
                                          odometry(1.2, 2, "/odom", "lidar"),
                                          odometry(1.6, 4, "/odom", "lidar"), cloud(1.05), cloud(1.4)};
  EXPECT_THAT(
      refusal(messages),
      says("/points at 1.400000000: no pose on /odom at its time: its neighbours in time are 0.400 s apart",
           "--skip-bad"));
  EXPECT_THAT(places(messages, {}, true), ElementsAre(DoubleNear(1.25, 1e-9)));
}

TEST_F(BagChoice, ScansComeInTheOrderOfTheirHeaders) {
  std::vector<McapMessage> messages{fixed("map", "lidar", 0), cloud(1003), cloud(1001), cloud(1002)};
  EXPECT_THAT(stamps(scans(messages)), ElementsAre(1001, 1002, 1003));
  messages.push_back(at(1003.5, cloud(0)));  // its driver has no clock
  EXPECT_THAT(stamps(scans(messages)), ElementsAre(1001, 1002, 1003, 1003.5));
}

TEST_F(BagChoice, DamageIsToldOrSkipped) {
  McapMessage bad_cloud = cloud(2), bad_tf = tf(2, "", "", 0);
  bad_cloud.bytes = bad_tf.bytes = "nonsense";
  std::vector<McapMessage> messages{fixed("map", "lidar", 0), cloud(1), bad_cloud, cloud(3)};
  EXPECT_THAT(refusal(messages), says("/points at 2.000000000", "not CDR", "but 6e 6f"));
  EXPECT_EQ(places(messages, {}, true).size(), 2U);
  messages[2] = bad_tf;
  EXPECT_THAT(refusal(messages), says("a.mcap /tf: message 1 not CDR", "--skip-bad"));
  EXPECT_EQ(places(messages, {}, true).size(), 2U);
}

McapMessage image(double stamp_s, const std::string& topic, const std::string& encoding,
                  const std::string& pixels = bytes_of(std::uint16_t{1000}, std::uint16_t{2000}),
                  std::uint32_t rows = 1) {
  CdrBytes message;
  message.header(stamp_s, "camera").u32(rows).u32(2).text(encoding).u8(0);
  message.u32(static_cast<std::uint32_t>(pixels.size()) / rows).bytes(pixels);
  return {topic, "sensor_msgs/msg/Image", stamp_s, message.all()};
}
McapMessage camera(const std::string& topic, double focal_length, double distortion = 0,
                   const std::string& model = "plumb_bob", std::uint32_t rows = 1, double middle = 0) {
  CdrBytes info;
  info.header(1, "camera").u32(rows).u32(2).text(model).u32(1).f64(distortion);
  const double K = focal_length, P = 2 * focal_length;
  for (const double f : {K, 0., middle, 0., K, middle, 0., 0., 1.}) info.f64(f);
  for (int i = 0; i < 9; ++i) info.f64(0);
  for (const double f : {P, 0., 0., 0., 0., P, 0., 0., 0., 0., 1., 0.}) info.f64(f);
  for (const std::uint32_t zero : {0, 0, 0, 0, 0, 0}) info.u32(zero);  // binning, roi
  return {topic, "sensor_msgs/msg/CameraInfo", 1, info.all()};
}

/// What a node receives one by one is read as out of a bag.
TEST_F(BagChoice, MessagesThatComeOneByOneAreReadAlike) {
  const McapMessage info = camera("/a/camera_info", 2), depth = image(1, "/a/image", "16UC1");
  const auto cdr = MessageEncoding::cdr;
  const Scan expected = scans({fixed("map", "camera", 0), info, depth}).at(0);
  const ReceivedScan received = scan_from_depth(depth.bytes, info.bytes, cdr, "here");
  EXPECT_EQ(received.scan.points, expected.points);
  EXPECT_EQ(received.scan.points.size(), 2U);
  EXPECT_EQ(received.scan.sensor, expected.sensor);
  EXPECT_EQ(received.frame, "camera");
  EXPECT_EQ(received.stamp_ns, 1000000000);
  EXPECT_EQ(scan_from_depth(depth.bytes, info.bytes, cdr, "here", true).scan.points[1].x() * 2,
            received.scan.points[1].x());
  const ReceivedScan point = scan_from_cloud(cloud(5).bytes, cdr, "here");
  EXPECT_THAT(point.scan.points, ElementsAre(Eigen::Vector3f(1, 2, 3)));
  EXPECT_EQ(point.scan.sensor, SensorKind::lidar);
  EXPECT_EQ(point.frame, "lidar");

  const std::string uncalibrated = camera("", 0).bytes;
  const McapMessage rows = image(1, "", "16UC1", "12345678", 2),
                    aside = camera("", 2, 0, "plumb_bob", 2, -3e6);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), stretched(2, 0, 0, 0);
  EXPECT_NO_THROW(require_camera(info.bytes, cdr, "here"));
  EXPECT_TRUE(pose_from_transform({1, 2, 3}, q, "here").linear().isApprox(q.toRotationMatrix(), 1e-15));
  for (const auto& [words, read] : std::vector<std::pair<const char*, std::function<void()>>>{
           {"not calibrated", [&] { scan_from_depth(depth.bytes, uncalibrated, cdr, "here"); }},
           {"not calibrated", [&] { require_camera(uncalibrated, cdr, "here"); }},
           {"principal point", [&] { scan_from_depth(rows.bytes, aside.bytes, cdr, "here"); }},
           {"here: ", [&] { scan_from_depth(depth.bytes, depth.bytes, cdr, "here"); }},
           {"here: ", [&] { scan_from_cloud(depth.bytes, cdr, "here"); }},
           {"too early", [&] { scan_from_cloud("", MessageEncoding::ros1, "here"); }},
           {"here",
            [&] {
              pose_from_transform({0, 0, 0}, stretched, "here");
            }},
           {"here", [&] {
              pose_from_transform({std::nan(""), 0, 0}, q, "here");
            }}})
    EXPECT_THAT(failure(Error::Kind::data, read), says("here", words));
}

/// Through a lens and without.
TEST(ImageMessages, HaveNoReadingsNearerThanAMillimetre) {
  for (const double k1 : {0.0, 0.01}) {
    const auto depth = [&](const McapMessage& image, double units) {
      const std::string info = camera("", 2, k1).bytes;
      return scan_from_depth(image.bytes, info, MessageEncoding::cdr, "", false, units).scan.points.at(0).z();
    };
    for (const float none : {1.4e-45F, 1e-39F, 1e-20F, 0.00099F})
      EXPECT_EQ(depth(image(1, "", "32FC1", bytes_of(none, 0.001F)), 1), 0.001F);
    EXPECT_EQ(depth(image(1, "", "16UC1", bytes_of(std::uint16_t{4}, std::uint16_t{5000})), 5000), 1);
  }
}

TEST_F(BagChoice, LibrealsensesUnitIsRead) {
  const std::string sensor = "/device_0/sensor_0/";
  const std::vector<McapMessage> messages{
      fixed("map", "camera", 0),
      camera(sensor + "Depth_0/info/camera_info", 1),
      {sensor + "option/Depth_Units/value", "std_msgs/msg/Float32", 1, CdrBytes().f32(0.0001F).all()},
      image(1, sensor + "Depth_0/image/data", "mono16")};
  EXPECT_THAT(open_scans({bag(messages)})->notes(),
              Contains(says("Depth_Units/value says 0.0001 m", "--depth-scale")));
  EXPECT_NEAR(scans(messages).at(0).points[0].z(), 0.1, 1e-6);
  EXPECT_EQ(read_all({bag(messages)}, {.depth_scale = 500}).at(0).points[0].z(), 2);
}

TEST_F(BagChoice, PicturesAreNoDepth) {
  const McapMessage map = fixed("map", "camera", 0),
                    colour = image(1, "/a/color", "rgb8", std::string(6, 'x'));
  EXPECT_THAT(refusal({map, colour}), says("encodings that are not read: /a/color (rgb8)", "16UC1"));
  const auto source =
      open_scans({bag({map, camera("/a/camera_info", 1), colour, image(1, "/a/depth", "16UC1")})});
  EXPECT_THAT(source->notes()[0], says("/a/depth"));
  EXPECT_THAT(source->notes()[1], says("camera: /a/camera_info (its K)"));
  const auto scans = read_all(*source);
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_THAT(scans[0].points, ElementsAre(Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(2, 0, 2)));
  EXPECT_EQ(scans[0].sensor, SensorKind::depth_camera);
}

TEST_F(BagChoice, ACameraIsFoundByItsNamespaceOrNameAndCalibrated) {
  const auto seen = [](const McapMessage& camera, const char* topic = "/a/depth") {
    return std::vector<McapMessage>{fixed("map", "camera", 0), camera, image(1, topic, "16UC1")};
  };
  EXPECT_THAT(
      refusal(seen(camera("/b/camera_info", 1, 0.1))),
      says("no CameraInfo on /a/camera_info", "/b/camera_info (sensor_msgs/CameraInfo)", "--intrinsics"));
  const auto source = open_scans({bag(seen(camera("/a/camera_info", 1, 0.1)))});
  EXPECT_THAT(source->notes()[2], says("distortion (plumb_bob) is undone"));
  const Eigen::Vector3f bent = read_all(*source).at(0).points[1];
  EXPECT_LT(bent.x(), 2) << "its K alone";
  EXPECT_NEAR(bent.x() / 2 * (1 + 0.1F * bent.x() * bent.x() / 4), 1, 1e-5F) << "as seen by the lens";
  EXPECT_THAT(open_scans({bag(seen(camera("/a/camera_info", 1, 0.1, "omni")))})->notes()[2],
              says("(omni)", "not undone"));
  EXPECT_EQ(scans(seen(camera("/a/camera_info", 1), "/a/image_rect")).at(0).points[1],
            Eigen::Vector3f(1, 0, 2))
      << "its P";
  EXPECT_THAT(refusal(seen(camera("/a/camera_info", 0))), says("not calibrated"));
}

class BagClocks : public BagChoice {
 protected:
  /// tf at 10 Hz and a cloud between each two, from 10 s on and again from 9.3 s on, 100 m farther: as when a
  /// simulation is reset, or NTP sets a clock.
  static std::vector<McapMessage> set_back(double logged_s) {
    std::vector<McapMessage> all{fixed("base", "lidar", 0)};
    for (int i = 0; i < 20; ++i) {
      const double stamp_s = (i < 10 ? 10 : 8.3) + 0.1 * i, now_s = logged_s + 0.1 * i;
      all.push_back(at(now_s, tf(stamp_s, "odom", "base", (i < 10 ? 0 : 100) + 0.1 * i)));
      if (i != 9 && i != 19) all.push_back(at(now_s + 0.06, cloud(stamp_s + 0.05)));
    }
    return all;
  }
};

TEST_F(BagClocks, AClockThatIsSetBackIsRefusedAndTheRecordersIsTakenIfAsked) {
  EXPECT_THAT(refusal(set_back(1000)), says("/tf: its clock is set back by 1.6", "--stamps recorded"));
  const std::vector<double> found = places(set_back(1000), {.recorded_stamps = true});
  ASSERT_EQ(found.size(), 18U);
  EXPECT_NEAR(found[0], 0.06, 1e-6);
  std::string poses;
  for (int i = 0; i < 18; ++i) poses += identity_pose;
  EXPECT_EQ(read_all({bag(set_back(1000))}, with_poses(write("p.txt", poses))).size(), 18U)
      << "its poses are not asked for";
}

TEST_F(BagClocks, MessagesLateOrTwiceSetNoneBack) {
  using Logged = std::array<double, 3>;  // when it is logged, its stamp, its place
  std::vector<Logged> one_late, late, twice, set_back, anew;
  for (int i = 0; i < 200; ++i) {  // at 50 Hz and 1 m/s
    const double x = 0.02 * i, s = 10 + x;
    late.push_back({s + 0.02 * (7 * i % 16), s, x});
    twice.insert(twice.end(), {Logged{s, s, x}, {11.7 + 0.1 * (i / 5), s, x}});
    one_late.push_back({i == 25 ? s + 0.2 : s, s, x});
    set_back.push_back({s, i < 100 ? s : s - 0.3, x});
    anew.push_back({s, i < 100 ? s : s - 9, x});
  }
  const auto recorded = [](std::vector<Logged> all) {
    std::ranges::stable_sort(all, {}, [](const Logged& one) { return one[0]; });
    std::vector<McapMessage> messages;
    for (const auto& [logged, stamp, x] : all) messages.push_back(at(logged, tf(stamp, "odom", "lidar", x)));
    messages.push_back(at(12, cloud(10.51)));
    return messages;
  };
  for (const auto* right : {&one_late, &late, &twice})
    EXPECT_THAT(places(recorded(*right)), ElementsAre(DoubleNear(0.51, 1e-6)));
  for (const auto* wrong : {&set_back, &anew})
    EXPECT_THAT(refusal(recorded(*wrong)), says("/tf: its clock is set back by", "--stamps recorded"));
}

TEST_F(BagClocks, ClocksThatDifferAreNamedAndTheRecordersTimeIsTakenIfAsked) {
  std::vector<McapMessage> messages;
  for (int i = 0; i < 10; ++i) {
    messages.push_back(at(1000 + 0.1 * i, tf(1.7e9 + 0.1 * i, "odom", "lidar", 0.1 * i)));
    messages.push_back(at(1000.02 + 0.1 * i, cloud(3484 + 0.1 * i)));
  }
  EXPECT_THAT(refusal(messages),
              says("/points is stamped 3484.000 s", "53.9 years from the poses recorded then: two clocks",
                   "--stamps recorded"));
  const std::vector<double> found = places(messages, {.recorded_stamps = true});
  ASSERT_EQ(found.size(), 10U);
  EXPECT_NEAR(found[3], 0.32, 1e-6);
}

TEST_F(BagClocks, ZeroIsATimeWhereOthersAreNearIt) {
  for (const double begin_s : {0, 50}) {
    std::vector<McapMessage> messages{at(50, cloud(0))};
    for (int i = 0; i < 3; ++i)
      messages.push_back(at(50 + 0.1 * i, tf(begin_s + 0.1 * i, "odom", "lidar", i)));
    messages.push_back(at(50.1, cloud(begin_s + 0.1)));
    EXPECT_THAT(stamps(scans(messages)), ElementsAre(begin_s, DoubleNear(begin_s + 0.1, 1e-9)));
  }
}

TEST_F(BagChoice, OfTwoRobotsTreesTheScansOneIsTaken) {
  std::vector<McapMessage> messages;
  for (const auto& [robot, at] : {std::pair("/a", 1), {"/b", 2}})
    for (McapMessage message : {fixed("base", "lidar", at), tf(1, "odom", "base", 10 * at)}) {
      message.topic = robot + message.topic;
      messages.push_back(message);
    }
  messages.push_back(cloud(1, "/b/points"));
  EXPECT_THAT(places(messages), ElementsAre(22));
  messages.back() = cloud(1);
  EXPECT_THAT(refusal(messages), says("several tf: /a/tf, /b/tf", "--poses"));
}

TEST_F(BagChoice, TwoParentsAreNamedWithTheOptionThatDecides) {
  std::vector<McapMessage> parents{fixed("base", "lidar", 0)};
  for (int i = 0; i < 20; ++i) {
    const double stamp_s = 1 + 0.1 * i;
    parents.push_back(tf(stamp_s, "odom", "base", 5));
    parents.push_back(tf(stamp_s + 0.03, "map", "base", 7));
  }
  parents.push_back(cloud(2));
  EXPECT_THAT(refusal(parents), says("base has two parents at a time, odom and map", "--fixed-frame"));
  EXPECT_THAT(places(parents, {.fixed_frame = "odom"}), ElementsAre(5));
  EXPECT_THAT(places(parents, {.fixed_frame = "map"}), ElementsAre(7));
}

TEST_F(BagChoice, AFixedPlaceThatChangesHoldsFromWhenItWasSent) {
  std::vector<McapMessage> messages{at(1, fixed("base", "lidar", 1))};
  for (int i = 0; i < 20; ++i) {
    messages.push_back(tf(1 + 0.1 * i, "odom", "base", 0.1 * i));
    if (i == 10) messages.push_back(at(2, fixed("base", "lidar", 100)));  // stamped as the first is
    messages.push_back(cloud(1 + 0.1 * i));
  }
  const std::vector<double> found = places(messages);
  ASSERT_EQ(found.size(), 20U);
  EXPECT_NEAR(found[9], 1.9, 1e-9);
  EXPECT_NEAR(found[10], 101, 1e-9);
}

TEST_F(BagChoice, CloudsAndPosesMayLieInTwoBags) {
  const auto clouds = write("sensors/a.mcap", mcap_of({cloud(1), cloud(2)})),
             state = write("state/b.mcap", mcap_of({fixed("base", "lidar", 1), tf(1, "odom", "base", 10),
                                                    tf(2, "odom", "base", 20)}));
  for (const auto& inputs : {std::vector{clouds, state}, {state, clouds}})
    EXPECT_THAT(test::places(read_all(inputs)), ElementsAre(11, 21));
  // Two whole recordings stay two.
  const auto one = mcap_of({tf(1, "odom", "lidar", 4), cloud(1)}),
             other = mcap_of({tf(1, "odom", "lidar", 5), cloud(1, "/other")});
  EXPECT_EQ(read_all({write("x/a.mcap", one), write("y/b.mcap", other)}).size(), 2U);
}

TEST_F(BagChoice, EachImageIsReadByTheCameraOfItsTime) {
  const auto info = [](double stamp_s, double focal_length) {
    McapMessage message = camera("/a/camera_info", focal_length);
    const std::string later = CdrBytes().header(stamp_s, "camera").all();
    message.bytes.replace(0, later.size(), later);
    return at(stamp_s, message);
  };
  const auto depth = [](double stamp_s) { return image(stamp_s, "/a/depth", "16UC1"); };
  std::vector<float> focal_lengths;
  for (const Scan& scan : scans(
           {fixed("map", "camera", 0), depth(1), info(1.5, 0), info(2, 1), depth(2.5), info(3, 4), depth(3)}))
    focal_lengths.push_back(2 / (scan.points[1].x() - scan.points[0].x() * 2));  // the second is 2 m deep
  EXPECT_THAT(focal_lengths, ElementsAre(1, 1, 4));
}

TEST(CameraInfo, OfPartsAndBinnedImagesIsOfTheWholeSensor) {
  io::CameraInfoMessage info;
  info.width = 160;
  info.height = 120;
  info.raw = {140, 150, 79.5, 59.5};
  for (const bool rectified : {false, true})  // P is not set
    EXPECT_EQ(io::intrinsics_for(info, rectified, 160, 120), info.raw);
  std::tie(info.binning_x, info.binning_y) = std::pair(2, 4);
  EXPECT_EQ(io::intrinsics_for(info, false, 80, 30),
            (io::Intrinsics{70, 37.5, 39.5, 14.5}));  // its middle stays
  std::tie(info.left, info.top, info.columns, info.rows) = std::tuple(40, 30, 100, 80);
  EXPECT_EQ(io::intrinsics_for(info, false, 50, 20), (io::Intrinsics{70, 37.5, 19.5, 7}));
  EXPECT_EQ(io::intrinsics_for(info, false, 160, 120), info.raw) << "the image is as the message says";
  EXPECT_THROW(io::intrinsics_for(info, false, 80, 30), std::runtime_error);
}

}  // namespace
}  // namespace octosurf::test
