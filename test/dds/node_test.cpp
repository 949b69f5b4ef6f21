// The node beside a robot of another vendor, over the loopback.
#include "dds/robot.hpp"
#include "support/bag_writer.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <numbers>
#include <octomap/OcTree.h>
#include <sstream>
#include <utility>

namespace octosurf::test {
namespace {

using convex_plane_decomposition_msgs::msg::dds_::PlanarTerrain_PubSubType;
using grid_map_msgs::msg::dds_::GridMap_PubSubType;
using octosurf_msgs::msg::dds_::Stairs_PubSubType;
using octosurf_msgs::msg::dds_::Surfaces_PubSubType;
using sensor_msgs::msg::dds_::CameraInfo_PubSubType;
using sensor_msgs::msg::dds_::Image_PubSubType;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAreArray;

namespace srv = octosurf_msgs::srv::dds_;
using QueryClient = Client<srv::Query_Request_PubSubType, srv::Query_Response_PubSubType>;
using ChangesClient = Client<srv::Changes_Request_PubSubType, srv::Changes_Response_PubSubType>;
using PublishClient = Client<srv::Publish_Request_PubSubType, srv::Publish_Response_PubSubType>;
using ClearClient = Client<srv::Clear_Request_PubSubType, srv::Clear_Response_PubSubType>;
using RegionsClient = Client<srv::ContactRegions_Request_PubSubType, srv::ContactRegions_Response_PubSubType>;

const std::string image_topic = "/camera/depth/image";

/// Until all that has come was mapped, refused or dropped, and that was `mapped` mapped.
bool has_mapped(const Status& status, std::uint64_t mapped) {
  return wait_until([&] { return status.last().mapped() == mapped && status.last().waiting() == 0; });
}

TEST_F(NodeTest, MapsSavesIsKilledAndGoesOnToTheMapOfTheRecording) {
  record();
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::best_effort);
  ASSERT_EQ(player.scans(), 6u);
  {
    const auto node = start({"--depth", image_topic, "-o", "live", "--checkpoint", "0"});
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    SaveClient save(*vendor, "/octosurf/save");
    ASSERT_TRUE(player.is_heard(status)) << node->errors();
    player.play(0, 4);
    ASSERT_TRUE(has_mapped(status, 4)) << node->errors() << status.last().last_refusal();
    const auto saved = save.call({});
    EXPECT_TRUE(saved.success()) << saved.message();
    node->send(SIGKILL);
    EXPECT_EQ(node->wait(), 128 + SIGKILL);
  }
  map_offline("half", "--first 4");
  EXPECT_TRUE(read("live.surfaces") == read("half.surfaces"));
  {
    const auto node = start({"--depth", image_topic, "-o", "live", "--resume"});
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    ASSERT_TRUE(player.is_heard(status)) << node->errors();
    player.play(4, 6);
    ASSERT_TRUE(has_mapped(status, 2)) << node->errors();
    EXPECT_EQ(end(*node), 0) << node->errors();
  }
  expect_live_is("offline");
}

TEST_F(NodeTest, MapsCloudsByAChainOfTransforms) {
  record("--sensor spinning --frames 3", "poses=chain");
  if (HasFatalFailure()) return;
  map_offline("boxed", "--self-box imu -1 -1.5 -3 1.5 1 3");
  ASSERT_TRUE(read("boxed.surfaces") != read("offline.surfaces"));
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node = start({"--cloud", "/lidar/points", "-o", "live", "--reliable", "--self-box", "imu", "-1",
                           "-1.5", "-3", "1.5", "1", "3"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status)) << node->errors();
  player.play(0, player.scans());
  ASSERT_TRUE(has_mapped(status, player.scans())) << node->errors();
  EXPECT_EQ(end(*node), 0) << node->errors();
  expect_live_is("boxed");
}

TEST_F(NodeTest, MapsWhatWaitsBeforeItEnds) {
  record();
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node = start({"--depth", image_topic, "-o", "live", "--reliable", "--wait", "60"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status)) << node->errors();
  const auto before = status.last().received();
  player.play(0, 6);
  ASSERT_TRUE(wait_until([&] { return status.last().received() == before + 6; })) << node->errors();
  EXPECT_EQ(end(*node), 0) << node->errors();  // the last one waits for a transform after it
  expect_live_is("offline");
}

TEST_F(NodeTest, GoesOnWhenTimeIsSetBack) {
  record();
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node = start({"--depth", image_topic, "-o", "live", "--reliable"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status)) << node->errors();
  player.play(0, 4);
  ASSERT_TRUE(has_mapped(status, 4)) << node->errors();
  player.shift_s = -100;
  player.play(0, 6);
  EXPECT_TRUE(has_mapped(status, 10)) << node->errors() << status.last().last_refusal();
  EXPECT_THAT(node->errors(), HasSubstr("time was set back by 1"));
  EXPECT_EQ(end(*node), 0) << node->errors();
}

TEST_F(NodeTest, NamesAPublisherThatIsNotHeard) {
  Publisher<Image_PubSubType> images(*vendor, "rt" + image_topic, Qos::best_effort);
  const auto node = start({"--depth", image_topic, "-o", "live", "--reliable"});
  EXPECT_TRUE(wait_until([&] { return node->errors().find("less reliability") != std::string::npos; }));
  EXPECT_THAT(node->errors(), HasSubstr("without --reliable"));
  EXPECT_EQ(end(*node), 0);
  const auto other = start({"--depth", image_topic, "-o", "live", "--tf", "/robot/tf"});
  EXPECT_TRUE(
      wait_until([&] { return other->errors().find("no publisher of /robot/tf") != std::string::npos; }));
  EXPECT_EQ(end(*other), 0);
}

TEST_F(NodeTest, IsFoundAsTheVariablesOfRos2Say) {
  const auto is_found = [&] {
    const auto node = start({"--depth", image_topic, "-o", "live"});
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    const bool found = wait_until([&] { return status.count() > 0; }, std::chrono::seconds(4));
    EXPECT_EQ(end(*node), 0) << node->errors();
    return found;
  };
  // The loopback, and nothing about where others are.
  setenv(
      "CYCLONEDDS_URI",
      "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces>"
      "</General></Domain></CycloneDDS>",
      1);
  setenv("ROS_LOCALHOST_ONLY", "1", 1);
  EXPECT_TRUE(is_found());
  unsetenv("ROS_LOCALHOST_ONLY");
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 1);
  EXPECT_TRUE(is_found());
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF", 1);
  EXPECT_FALSE(is_found());
  setenv("ROS_STATIC_PEERS", "127.0.0.1;", 1);
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET", 1);
  EXPECT_TRUE(is_found());
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "MOON", 1);
  const auto node = start({"--depth", image_topic, "-o", "live"});
  EXPECT_EQ(node->wait(), 2);
  EXPECT_THAT(node->errors(), HasSubstr("SUBNET, LOCALHOST, OFF"));
  unsetenv("ROS_STATIC_PEERS");
  unsetenv("ROS_AUTOMATIC_DISCOVERY_RANGE");
}

TEST_F(NodeTest, IsShownToTheToolsOfRos2) {
  using rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_PubSubType;
  Subscription<ParticipantEntitiesInfo_PubSubType> infos(*vendor, "ros_discovery_info", Qos::latched);
  const auto node = start({"--depth", image_topic, "-o", "live", "--name", "/robot/octosurf"});
  ASSERT_TRUE(wait_until([&] { return infos.count() > 0; })) << node->errors();
  const auto info = infos.last().node_entities_info_seq().at(0);
  EXPECT_EQ(info.node_namespace(), "/robot");
  EXPECT_EQ(info.node_name(), "octosurf");
  EXPECT_EQ(info.reader_gid_seq().size(), 4u + 8u);  // topics and services
  EXPECT_EQ(info.writer_gid_seq().size(), 9u);
  // Without a hash of their types ROS 2 warns about endpoints.
  const auto hash_of = [&](const std::string& topic) {
    EXPECT_TRUE(wait_until([&] { return !vendor->user_data(topic).empty(); })) << topic;
    return vendor->user_data(topic);
  };
  for (const std::string topic : {"surfaces", "stairs", "markers", "planar_terrain", "octomap_binary",
                                  "grid_map", "status", "heights", "patch"})
    EXPECT_THAT(hash_of("rt/robot/octosurf/" + topic), HasSubstr("typehash=RIHS01_"));
  EXPECT_THAT(hash_of("rr/robot/octosurf/saveReply"), HasSubstr("typehash=RIHS01_"));
  EXPECT_THAT(hash_of("rr/robot/octosurf/saveReply"), HasSubstr("serviceid="));
  EXPECT_EQ(end(*node), 0);
}

/// Clients of rmw_cyclonedds_cpp are discovered piece by piece: the reply waits for the one who asked.
TEST_F(NodeTest, AnswersAClientWhoseReaderIsFoundLate) {
  const auto node = start({"--depth", image_topic, "-o", "live"});
  const std::string me = "clientid=1.2.3;";
  SaveClient other(*vendor, "/octosurf/save");  // another reader of replies
  ASSERT_TRUE(other.call({}).success()) << node->errors();
  Publisher<srv::Save_Request_PubSubType> requests(*vendor, "rq/octosurf/saveRequest", Qos::reliable, 100,
                                                   me);
  srv::Save_Request_ request;
  request.call().client(77);
  request.call().number(5);
  request.file("late");
  ASSERT_TRUE(spoken_until([&] { requests.publish(request); }, [&] { return exists("late.surfaces"); },
                           std::chrono::milliseconds(200)));
  request.file("later");
  request.call().number(6);
  requests.publish(request);
  ASSERT_TRUE(wait_until([&] { return exists("later.surfaces"); }));
  Subscription<srv::Save_Response_PubSubType> replies(*vendor, "rr/octosurf/saveReply", Qos::reliable, me);
  EXPECT_TRUE(wait_until([&] { return replies.last().call().number() == 6; }, std::chrono::seconds(5)));
  EXPECT_EQ(end(*node), 0);
}

/// What is published is what lies about the robot; the rest is to be had on request.
TEST_F(NodeTest, PublishesWhatLiesAboutTheRobotAndEverythingOnRequest) {
  record();
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node =
      start({"--depth", image_topic, "-o", "live", "--reliable", "--radius", "1", "--base", "camera"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status)) << node->errors();
  Subscription<Surfaces_PubSubType> surfaces(*vendor, "rt/octosurf/surfaces", Qos::latched);
  Subscription<octomap_msgs::msg::dds_::Octomap_PubSubType> octomap(*vendor, "rt/octosurf/octomap_binary",
                                                                    Qos::latched);
  Subscription<GridMap_PubSubType> patch(*vendor, "rt/octosurf/patch", Qos::best_effort);
  player.play(0, player.scans());
  ASSERT_TRUE(has_mapped(status, player.scans())) << node->errors();
  const std::uint64_t revision = status.last().revision();
  ASSERT_TRUE(wait_until([&] { return surfaces.last().revision() == revision && octomap.count() > 0; }));
  const auto near = surfaces.last();
  const std::size_t near_bytes = octomap.last().data().size();
  // About the robot: its place is the middle of its patch.
  const int patches = patch.count();  // some are of poses on the way
  ASSERT_TRUE(wait_until([&] { return patch.count() > patches + 2; })) << node->errors();
  EXPECT_EQ(patch.last().layers(), (std::vector<std::string>{"elevation", "cell", "slope", "edge"}));
  const auto place = patch.last().info().pose().position();
  const double z = 0;  // of the floor
  std::ostringstream box;
  box << "query offline --json --box";
  for (const double side : {-1.13, 1.13})  // the box follows when the robot has moved by an eighth
    box << ' ' << place.x() + side << ' ' << place.y() + side << ' ' << z + 1.5 + 2 * side;
  const auto within =
      nlohmann::json::parse(run_well(box.str()).out).at("surfaces").get<std::vector<std::uint32_t>>();
  std::vector<std::uint32_t> ids;
  for (const auto& surface : near.surfaces()) ids.push_back(surface.id());
  EXPECT_TRUE(std::ranges::includes(within, ids)) << ::testing::PrintToString(ids);
  const std::size_t all = info("offline").at("surfaces");
  EXPECT_LT(ids.size(), all);
  EXPECT_FALSE(ids.empty());
  // Nothing is published while nothing changes.
  const int count = surfaces.count() + octomap.count(), rounds = status.count();
  ASSERT_TRUE(wait_until([&] { return status.count() > rounds + 5; }));
  EXPECT_EQ(surfaces.count() + octomap.count(), count);

  PublishClient publish(*vendor, "/octosurf/publish");
  ASSERT_TRUE(publish.call({}).success());
  EXPECT_TRUE(wait_until([&] { return surfaces.last().surfaces().size() == all; }));
  EXPECT_TRUE(wait_until([&] { return octomap.last().data().size() > 2 * near_bytes; }));
  EXPECT_GT(status.last().published_bytes(), near_bytes);
  EXPECT_GT(status.last().publish_ms(), 0);
  srv::Publish_Request_ wrong;
  wrong.radius(-1);
  EXPECT_FALSE(publish.call(wrong).success());

  ChangesClient changes(*vendor, "/octosurf/changes");
  srv::Changes_Request_ asked;
  EXPECT_EQ(changes.call(asked).changed().surfaces().size(), all);
  asked.low() = asked.high() = place;
  asked.high().x(place.x() + 2);
  asked.high().z(z - 1);
  asked.low().z(z + 1);
  const auto below = changes.call(asked).changed().surfaces().size();
  EXPECT_GT(below, 0u);
  EXPECT_LT(below, all);
  asked.since(revision);
  EXPECT_EQ(changes.call(asked).changed().surfaces().size(), 0u);
  asked.since(revision + 1);
  EXPECT_FALSE(changes.call(asked).success());

  ClearClient clear(*vendor, "/octosurf/clear");
  srv::Clear_Request_ everything;
  everything.size().x(100);
  everything.size().y(100);
  everything.size().z(100);
  const auto cleared = clear.call(everything);
  ASSERT_TRUE(cleared.success()) << cleared.message();
  EXPECT_THAT(cleared.message(), HasSubstr(std::to_string(all) + " surfaces gone"));
  EXPECT_GT(cleared.revision(), revision);
  EXPECT_TRUE(wait_until([&] { return surfaces.last().surfaces().empty(); }));
  asked = {};
  asked.since(revision);
  EXPECT_EQ(changes.call(asked).gone().size(), all);
  EXPECT_EQ(end(*node), 0) << node->errors();
}

TEST_F(NodeTest, SaysWhatIsWrongWithItsUse) {
  write("there.surfaces", "");
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"-o", "m"},
                                             {"-o", "m", "--depth", "no_slash"},
                                             {"-o", "m", "--depth", "/d", "--cloud", "/c"},
                                             {"-o", "m", "--cloud", "/c", "--hit", "-1"},
                                             {"-o", "there", "--cloud", "/c"}}) {
    const auto node = start(arguments);
    EXPECT_EQ(node->wait(), 2) << ::testing::PrintToString(arguments);
    EXPECT_NE(node->errors(), "");
  }
}

/// A node that has mapped the recording, and goes on; shared by all tests that only query it.
class MappedRoom : public NodeTest {
 public:
  MappedRoom() {
    SetUp();
    if (IsSkipped()) return;
    record();
    if (HasFatalFailure()) return;
    Player player(*vendor, folder / "walk.db3", Qos::reliable);
    node = start({"--depth", image_topic, "-o", "live", "--reliable", "--foot-radius", "0.05", "--max-slope",
                  "20", "--clearance", "0.3"});
    status = std::make_unique<Status>(*vendor, "rt/octosurf/status", Qos::latched);
    EXPECT_TRUE(player.is_heard(*status)) << node->errors();
    player.play(0, player.scans());
    EXPECT_TRUE(has_mapped(*status, player.scans())) << node->errors();
    query = std::make_unique<QueryClient>(*vendor, "/octosurf/query");
    regions = std::make_unique<RegionsClient>(*vendor, "/octosurf/contact_regions");
    offline = info("offline");
    for (const Player::Message& message : player.messages())
      if (message.topic == image_topic)
        last_stamp = deserialised<Image_PubSubType>(message.cdr).header().stamp();
  }
  void TestBody() override {}

  using NodeTest::end, NodeTest::folder, NodeTest::read, NodeTest::read_json, NodeTest::info,
      NodeTest::map_offline, NodeTest::run_well, NodeTest::vendor;
  /// The last map that the node has published on a topic, for one who comes when all is over.
  template <class Support>
  typename Support::type latched(const std::string& topic) {
    Subscription<Support> subscription(*vendor, "rt/octosurf/" + topic, Qos::latched);
    EXPECT_TRUE(wait_until([&] { return subscription.count() > 0; })) << topic;
    return subscription.last();
  }

  std::unique_ptr<Running> node;
  std::unique_ptr<Status> status;
  std::unique_ptr<QueryClient> query;
  std::unique_ptr<RegionsClient> regions;
  nlohmann::json offline;
  builtin_interfaces::msg::dds_::Time_ last_stamp;  // of its scans
};

class LiveMap : public ::testing::Test {
 protected:
  using Question = srv::Query_Request_;
  using Answer = srv::Query_Response_;
  using Regions = srv::ContactRegions_Request_;

  void SetUp() override {
    if (!can_write_bags()) GTEST_SKIP() << no_bag_writer;
    if (!room) room = std::make_unique<MappedRoom>();
    if (HasFailure()) GTEST_FAIL() << "the room is not mapped";
  }
  // Not in a test, whose clients need the room's participant to the end.
  void TearDown() override {
    if (used_up) room.reset();
  }
  static void TearDownTestSuite() { room.reset(); }

  enum Kind : std::uint8_t { nearest, below, ray, sphere, box, voxel, ground };
  static Question question(Kind kind, double x, double y, double z) {
    Question question;
    question.kind(kind);
    question.point().x(x);
    question.point().y(y);
    question.point().z(z);
    return question;
  }
  /// A place on the floor, queried from 2 m above.
  Answer floor() {
    Answer found;
    for (double x = -3; !found.found() && x < 6; x += 0.5)
      for (double y = -3; !found.found() && y < 6; y += 0.5)
        found = room->query->call(question(below, x, y, 2));
    return found;
  }
  /// What `octosurf query` says of the same map.
  nlohmann::json offline_answer(const std::string& asked) const {
    return nlohmann::json::parse(room->run_well("query offline --json " + asked).out);
  }
  static std::string words(const std::vector<double>& numbers) {
    std::ostringstream text;
    text.precision(17);
    for (const double number : numbers) text << ' ' << number;
    return text.str();
  }

  static std::unique_ptr<MappedRoom> room;
  bool used_up = false;  ///< the node has ended, or has another map than the other tests expect
};

std::unique_ptr<MappedRoom> LiveMap::room;

TEST_F(LiveMap, IsPublishedAsTheOfflineMap) {
  // The other outputs are written after this one of the same round, and status after all.
  Subscription<Surfaces_PubSubType> surfaces(*room->vendor, "rt/octosurf/surfaces", Qos::latched);
  ASSERT_TRUE(wait_until([&] { return surfaces.last().revision() == room->status->last().revision(); }));
  const int before = room->status->count();
  ASSERT_TRUE(wait_until([&] { return room->status->count() > before + 1; }));

  room->run_well("export offline --as-mapped --to offline.json");
  const nlohmann::json expected = room->read_json("offline.json");
  const auto published = surfaces.last();
  std::vector<double> areas, expected_areas;
  double total_area = 0;
  for (const auto& surface : published.surfaces()) areas.push_back(surface.area());
  for (const auto& surface : expected.at("surfaces")) expected_areas.push_back(surface.at("area_m2"));
  for (const double area : areas) total_area += area;
  EXPECT_THAT(areas, UnorderedElementsAreArray(expected_areas));
  EXPECT_EQ(published.header().frame_id(), "map");
  EXPECT_EQ(published.header().stamp(), room->last_stamp);
  EXPECT_EQ(room->status->last().header().stamp(), room->last_stamp);
  EXPECT_GT(room->status->last().scan_ms(), 0);
  EXPECT_GT(room->status->last().agreement(), 0.9);
  for (const auto& surface : published.surfaces()) {
    const auto same_id = [&](const nlohmann::json& other) { return other.at("id") == surface.id(); };
    const auto found = std::find_if(expected.at("surfaces").begin(), expected.at("surfaces").end(), same_id);
    ASSERT_NE(found, expected.at("surfaces").end());
    EXPECT_NEAR(surface.offset(), found->at("plane").at("offset").get<double>(), 1.1e-9);
    EXPECT_NEAR(surface.normal().z(), found->at("plane").at("normal").at(2).get<double>(), 1.1e-9);
    EXPECT_EQ(surface.inliers(), found->at("inliers"));
    EXPECT_EQ(surface.revision(), found->at("revision"));
    const auto& corner = surface.polygons().at(0).outer().points().at(0);
    const nlohmann::json& vertex = found->at("polygons").at(0).at("outer").at(0);
    EXPECT_NEAR(corner.x(), vertex.at(0).get<double>(), 1.1e-9);
    EXPECT_NEAR(corner.y(), vertex.at(1).get<double>(), 1.1e-9);
    EXPECT_NEAR(corner.z(), vertex.at(2).get<double>(), 1.1e-9);
  }

  const auto stairs = room->latched<Stairs_PubSubType>("stairs");
  EXPECT_EQ(stairs.revision(), published.revision());
  EXPECT_EQ(stairs.header().frame_id(), "map");
  EXPECT_EQ(stairs.stairs().size(), expected.at("stairs").size());
  ASSERT_EQ(stairs.single_steps().size(), expected.at("steps").size());
  for (std::size_t i = 0; i < stairs.single_steps().size(); ++i) {
    EXPECT_NEAR(stairs.single_steps()[i].riser(), expected.at("steps")[i].at("riser_m").get<double>(), 1e-4);
  }

  double shown_area = 0;
  const auto markers = room->latched<visualization_msgs::msg::dds_::MarkerArray_PubSubType>("markers");
  ASSERT_EQ(markers.markers().size(), areas.size() + 1);
  EXPECT_EQ(markers.markers()[0].action(), 3);
  for (const auto& marker : markers.markers()) {
    const auto& points = marker.points();
    ASSERT_EQ(points.size() % 3, 0u);
    const auto at = [&](std::size_t i) {
      return Eigen::Vector3d(points[i].x(), points[i].y(), points[i].z());
    };
    for (std::size_t i = 0; i < points.size(); i += 3)
      shown_area += (at(i + 1) - at(i)).cross(at(i + 2) - at(i)).norm() / 2;
  }
  EXPECT_NEAR(shown_area, total_area, 0.05 * total_area);  // outlines are simplified by up to half a voxel

  room->run_well(
      "export offline --format planar_terrain --to terrain.cdr --foot-radius 0.05 --max-slope 20 "
      "--clearance 0.3");
  room->run_well("export offline --format grid_map --to grid.cdr --max-slope 20");
  auto terrain = room->latched<PlanarTerrain_PubSubType>("planar_terrain");
  auto grid = room->latched<GridMap_PubSubType>("grid_map");
  EXPECT_EQ(grid.header().stamp(), room->last_stamp);
  EXPECT_EQ(terrain.gridmap().header().stamp(), room->last_stamp);
  EXPECT_EQ(markers.markers().back().header().stamp(), room->last_stamp);
  EXPECT_EQ(room->latched<octomap_msgs::msg::dds_::Octomap_PubSubType>("octomap_binary").header().stamp(),
            room->last_stamp);
  grid.header().stamp({});  // a file is of no time
  terrain.gridmap().header().stamp({});
  EXPECT_TRUE(serialised<PlanarTerrain_PubSubType>(terrain) == room->read("terrain.cdr"));
  EXPECT_TRUE(serialised<GridMap_PubSubType>(grid) == room->read("grid.cdr"));
}

TEST_F(LiveMap, HasAnOctomapThatOctomapReadsAndWritesAgain) {
  using octomap_msgs::msg::dds_::Octomap_PubSubType;
  Subscription<Octomap_PubSubType> octomap(*room->vendor, "rt/octosurf/octomap_binary", Qos::latched);
  octomap::OcTree expected((room->folder / "offline.bt").string());
  const auto same = [&] {
    if (octomap.count() == 0) return false;
    const auto message = octomap.last();
    EXPECT_TRUE(message.binary());
    EXPECT_EQ(message.id(), "OcTree");
    octomap::OcTree tree(message.resolution());
    std::stringstream data(std::string(message.data().begin(), message.data().end()));
    tree.readBinaryData(data);
    std::ostringstream again;
    tree.writeBinaryData(again);
    EXPECT_TRUE(again.str() == data.str());
    tree.prune();
    return tree == expected;
  };
  EXPECT_TRUE(wait_until(same));
}

TEST_F(LiveMap, AnswersAboutPlacesAreThoseOfTheOfflineMap) {
  const Answer on_floor = floor();
  ASSERT_TRUE(on_floor.success() && on_floor.found()) << on_floor.message();
  EXPECT_EQ(on_floor.revision(), room->offline.at("revision"));
  const double x = on_floor.point().x(), y = on_floor.point().y(), z = on_floor.point().z();
  Question down = question(ray, x, y, 2), near = question(sphere, x, y, z), boxed = question(box, x, y, z);
  down.direction().z(-1);
  near.distance(1.5);
  boxed.corner().x(x - 1);
  boxed.corner().y(y + 2);
  boxed.corner().z(z - 0.5);
  const std::vector<std::pair<Question, std::string>> all{
      {question(below, x, y, 2), "--below" + words({x, y, 2})},
      {question(nearest, x, y, 2), "--nearest" + words({x, y, 2})},
      {down, "--ray" + words({x, y, 2, 0, 0, -1})},
      {near, "--sphere" + words({x, y, z, 1.5})},
      {boxed, "--box" + words({x - 1, y, z - 0.5, x, y + 2, z})},
      {question(voxel, x, y, z), "--voxel" + words({x, y, z})},
      {question(voxel, x, y, z + 0.5), "--voxel" + words({x, y, z + 0.5})},
      {question(voxel, x, y, 9), "--voxel" + words({x, y, 9})}};
  const std::vector<std::string> states{"unknown", "free", "occupied"};
  for (const auto& [asked, in_words] : all) {
    SCOPED_TRACE(in_words);
    const Answer there = room->query->call(asked);
    const nlohmann::json known = offline_answer(in_words);
    const auto number = [&](const char* place, double other) {
      const nlohmann::json::json_pointer at(place);
      return known.contains(at) && known.at(at).is_number() ? known.at(at).get<double>() : other;
    };
    nlohmann::json surfaces = known.value("surfaces", nlohmann::json::array());
    if (const auto id = number("/surface", 0); id > 0) surfaces = {id};
    EXPECT_EQ(there.surfaces(), surfaces.get<std::vector<std::uint32_t>>());
    EXPECT_EQ(states.at(there.state()), known.value("state", "unknown"));
    EXPECT_NEAR(there.log_odds(), number("/log_odds", 0), 1e-5);
    EXPECT_EQ(there.found(), known.contains("distance_m"));
    EXPECT_NEAR(there.distance(), number("/distance_m", 0), 1e-6);
    EXPECT_NEAR(there.normal().z(), number("/normal/2", there.normal().z()), 1e-6);
    EXPECT_EQ(there.front(), known.value("side", "back") == "front");
  }

  const Answer stands = room->query->call(question(ground, x, y, z + 0.1));
  EXPECT_TRUE(stands.success() && stands.found()) << stands.message();
  EXPECT_EQ(stands.surfaces(), on_floor.surfaces());
  EXPECT_EQ(stands.ground(), "supported");
  EXPECT_NEAR(stands.distance(), 0.1, 0.02);
  Question outside = question(ground, x + 200, y, z);
  outside.surface(on_floor.surfaces()[0]);
  EXPECT_EQ(room->query->call(outside).ground(), "unseen");
  outside.surface(1'000'000);
  EXPECT_FALSE(room->query->call(outside).success());
  EXPECT_THAT(room->query->call(question(static_cast<Kind>(77), x, y, z)).message(),
              HasSubstr("octosurf_msgs/Query"));
}

TEST_F(LiveMap, AnswersAboutContactsAndPlans) {
  const Answer on_floor = floor();
  ASSERT_TRUE(on_floor.found()) << on_floor.message();
  Regions contact;
  contact.surface(on_floor.surfaces().at(0));
  contact.length(0.22);
  contact.width(0.11);
  contact.any_heading(true);
  contact.max_slope(std::numbers::pi);
  contact.pieces(3);
  const auto found = room->regions->call(contact);
  ASSERT_TRUE(found.success()) << found.message();
  ASSERT_EQ(found.regions().size(), 1u);
  const nlohmann::json expected = offline_answer("--regions " + std::to_string(on_floor.surfaces()[0]) +
                                                 " --foot 0.22x0.11 --max-slope 180 --pieces 3");
  EXPECT_NEAR(found.regions()[0].area(), expected.at("area_m2").get<double>(), 1e-8);
  EXPECT_EQ(found.regions()[0].pieces().size(), expected.at("pieces").size());
  contact.about() = on_floor.point();
  contact.reach(0.5);
  const auto about = room->regions->call(contact).regions().at(0);
  EXPECT_GT(about.area(), 0);
  EXPECT_LT(about.area(), std::min(found.regions()[0].area(), 1 + 1e-9));
  contact.reach(0);
  contact.as_mapped(true);
  EXPECT_GT(room->regions->call(contact).regions().at(0).area(), found.regions()[0].area());
  contact.surface(0);
  EXPECT_EQ(room->regions->call(contact).regions().size(), room->offline.at("surfaces").get<std::size_t>());
  contact.length(-1);
  EXPECT_FALSE(room->regions->call(contact).success());

  Client<srv::Plan_Request_PubSubType, srv::Plan_Response_PubSubType> plan(*room->vendor, "/octosurf/plan");
  srv::Plan_Request_ way;
  way.robot("snake");
  EXPECT_THAT(plan.call(way).message(), HasSubstr("quadruped"));
  way.robot("biped");
  way.start().x(100);  // where there is nothing to stand on
  const auto nowhere = plan.call(way);
  EXPECT_TRUE(nowhere.success());
  EXPECT_FALSE(nowhere.found());
  EXPECT_NE(nowhere.message(), "");

  // Where half a metre of floor is about the robot it can stand, and make a step.
  Regions open;
  open.radius(0.5);
  open.any_heading(true);
  open.max_slope(0.1);
  const auto open_floor = room->regions->call(open).regions();
  const auto place = std::find_if(open_floor.begin(), open_floor.end(),
                                  [](const auto& region) { return !region.polygons().empty(); });
  ASSERT_NE(place, open_floor.end());
  way.start() = way.goal() = place->polygons()[0].outer().points()[0];
  way.goal().x(way.start().x() + 0.15);
  way.time_limit(600);
  const auto steps = plan.call(way);
  ASSERT_TRUE(steps.found()) << steps.message();
  EXPECT_EQ(steps.start().size(), 2u);
  EXPECT_GT(steps.steps().size(), 0u);
  EXPECT_GE(steps.cost(), steps.lower_bound());
  for (const auto& step : steps.steps()) {
    EXPECT_EQ(step.surface(), place->surface());
    EXPECT_GT(step.margin(), 0);
  }
}

TEST_F(LiveMap, IsSavedAndLoadedBesideTheNodesOwnOnly) {
  SaveClient save(*room->vendor, "/octosurf/save");
  Client<srv::Load_Request_PubSubType, srv::Load_Response_PubSubType> load(*room->vendor, "/octosurf/load");
  srv::Save_Request_ other;
  for (const std::string name : {"../x", "/tmp/x", ".x", "a/b"}) {
    other.file(name);
    EXPECT_THAT(save.call(other).message(), HasSubstr("plain name")) << name;
  }
  other.file("other");
  EXPECT_THAT(save.call(other).message(), HasSubstr("other: "));
  EXPECT_TRUE(room->read("other.surfaces") == room->read("offline.surfaces"));
  room->map_offline("first", "--first 1");
  const std::string before = room->read("first.surfaces");
  srv::Load_Request_ first;
  first.file("none");
  EXPECT_FALSE(load.call(first).success());
  EXPECT_EQ(room->info("other").at("revision"), room->status->last().revision());
  first.file("first");
  const auto loaded = load.call(first);
  EXPECT_TRUE(loaded.success()) << loaded.message();
  EXPECT_THAT(loaded.message(), HasSubstr("no longer as live"));
  const auto revision = room->info("first").at("revision").get<std::uint64_t>();
  EXPECT_TRUE(wait_until([&] { return room->status->last().revision() == revision; }));
  EXPECT_THAT(save.call({}).message(), HasSubstr("first: "));  // it is the node's own now
  EXPECT_EQ(MappedRoom::end(*room->node), 0);
  EXPECT_TRUE(room->read("first.surfaces") == before);
  used_up = true;
}

}  // namespace
}  // namespace octosurf::test
