// The node beside a robot of another vendor, over the loopback.
#include "dds/robot.hpp"
#include "planning/questions.hpp"
#include "support/degree.hpp"

#include <iostream>
#include <limits>
#include <numbers>
#include <octomap/OcTree.h>
#include <sstream>

#include <octosurf/contact.hpp>
#include <octosurf/ground.hpp>
#include <octosurf/map.hpp>
#include <octosurf/planning.hpp>
#include <octosurf/ros_messages.hpp>
#include <octosurf/up.hpp>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

TEST_F(NodeTest, MapsSavesIsKilledAndGoesOnToTheMapOfTheRecording) {
  start_heard({"--depth", image_topic, "--checkpoint", "0"}, Qos::best_effort);
  if (HasFatalFailure()) return;
  ASSERT_EQ(player->scans(), 6u);
  play_mapped(0, 4, 4);
  const Json saved = Client(*vendor, "/octosurf/save", "Save").call();
  EXPECT_EQ(saved.at("success"), true) << saved;
  node->send(SIGKILL);
  EXPECT_EQ(node->wait(), 128 + SIGKILL);
  map_offline("half", "--first 4");
  EXPECT_TRUE(read("live.surfaces") == read("half.surfaces"));
  start_heard({"--depth", image_topic, "--resume"}, Qos::best_effort);
  play_mapped(4, 6, 2);
  end();
  expect_live_is("offline");
}

TEST_F(NodeTest, MapsCloudsByAChainOfTransforms) {
  start_heard(
      {"--cloud", "/lidar/points", "--reliable", "--self-box", "imu", "-1", "-1.5", "-3", "1.5", "1", "3"},
      Qos::reliable, "--sensor spinning --frames 3", "poses=chain");
  if (HasFatalFailure()) return;
  map_offline("boxed", "--self-box imu -1 -1.5 -3 1.5 1 3");
  ASSERT_TRUE(read("boxed.surfaces") != read("offline.surfaces"));
  play_mapped(0, player->scans(), player->scans());
  end();
  expect_live_is("boxed");
}

TEST_F(NodeTest, MapsWhatWaitsBeforeItEnds) {
  start_heard({"--depth", image_topic, "--reliable", "--wait", "60"}, Qos::reliable);
  if (HasFatalFailure()) return;
  const auto before = last_status().at("received").get<int>();
  player->play(0, 6);
  ASSERT_TRUE(wait_until([&] { return last_status().at("received") == before + 6; })) << node->errors();
  end();  // the last one waits for a transform after it
  expect_live_is("offline");
}

TEST_F(NodeTest, GoesOnWhenTimeIsSetBack) {
  start_heard({"--depth", image_topic, "--reliable"}, Qos::reliable);
  if (HasFatalFailure()) return;
  play_mapped(0, 4, 4);
  player->shift_s = -100;
  play_mapped(0, 6, 10);
  EXPECT_THAT(node->errors(), HasSubstr("time was set back by 1"));
  end();
}

TEST_F(NodeTest, NamesAPublisherThatIsNotHeard) {
  Publisher images(*vendor, "rt" + image_topic, "sensor_msgs/Image", Qos::best_effort);
  start({"--depth", image_topic, "--reliable"});
  EXPECT_TRUE(says("less reliability"));
  EXPECT_THAT(node->errors(), HasSubstr("without --reliable"));
  end();
  start({"--depth", image_topic, "--tf", "/robot/tf"});
  EXPECT_TRUE(says("no publisher of /robot/tf"));
  end();
  start({"--depth", "/camera/misspelt"});
  EXPECT_TRUE(says("no publisher of /camera/misspelt, whose scans are mapped"));
  end();
}

TEST_F(NodeTest, IsFoundAsTheVariablesOfRos2Say) {
  const auto is_found = [&] {
    start({"--depth", image_topic});
    const bool found = wait_until([&] { return status->count() > 0; }, std::chrono::seconds(4));
    end();
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
  start({"--depth", image_topic});
  EXPECT_EQ(node->wait(), 2);
  EXPECT_THAT(node->errors(), HasSubstr("SUBNET, LOCALHOST, OFF"));
  unsetenv("ROS_STATIC_PEERS");
  unsetenv("ROS_AUTOMATIC_DISCOVERY_RANGE");
}

TEST_F(NodeTest, IsShownToTheToolsOfRos2) {
  Subscription infos(*vendor, "ros_discovery_info", "rmw_dds_common/ParticipantEntitiesInfo", Qos::latched);
  start({"--depth", image_topic, "--name", "/robot/octosurf"});
  ASSERT_TRUE(wait_until([&] { return infos.count() > 0; })) << node->errors();
  const Json info = infos.last().at("node_entities_info_seq").at(0);
  EXPECT_EQ(info.at("node_namespace"), "/robot");
  EXPECT_EQ(info.at("node_name"), "octosurf");
  EXPECT_EQ(info.at("reader_gid_seq").size(), 4u + 8u);  // topics and services
  EXPECT_EQ(info.at("writer_gid_seq").size(), 9u);
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
  end();
}

/// Clients of rmw_cyclonedds_cpp are discovered piece by piece: the reply waits for the one who asked.
TEST_F(NodeTest, AnswersAClientWhoseReaderIsFoundLate) {
  start({"--depth", image_topic});
  const std::string me = "clientid=1.2.3;";
  Client other(*vendor, "/octosurf/save", "Save");  // another reader of replies
  ASSERT_EQ(other.call().at("success"), true) << node->errors();
  const Publisher requests(*vendor, "rq/octosurf/saveRequest", "Save_Request", Qos::reliable, 100, me);
  const auto request = [&](const char* file, int number) {
    requests.publish(Json{{"file", file}, {"call", {{"client", 77}, {"number", number}}}});
  };
  ASSERT_TRUE(spoken_until([&] { request("late", 5); }, [&] { return exists("late.surfaces"); },
                           std::chrono::milliseconds(200)));
  request("later", 6);
  ASSERT_TRUE(wait_until([&] { return exists("later.surfaces"); }));
  Subscription replies(*vendor, "rr/octosurf/saveReply", "Save_Response", Qos::reliable, me);
  EXPECT_TRUE(
      wait_until([&] { return replies.last().at("call").at("number") == 6; }, std::chrono::seconds(5)));
  end();
}

/// What robots send that is broken is refused and counted, with a reason, and the map is what it is without.
TEST_F(NodeTest, RefusesWhatIsBrokenAndNothingIsLost) {
  start_heard({"--depth", image_topic, "--reliable", "--wait", "0.2"}, Qos::reliable);
  if (HasFatalFailure()) return;
  play_mapped(0, 2, 2);
  const auto refused = [&](const char* counted, const std::string& what,
                           const std::function<void()>& publish) {
    const auto before = last_status().at(counted).get<int>();
    publish();
    EXPECT_TRUE(wait_until([&] { return last_status().at(counted) == before + 1; }))
        << what << node->errors();
    return last_status().at("last_refusal").get<std::string>();
  };
  const Json image = player->first(image_topic), tf = player->first("/tf");
  const std::string pixels = image.at("data");
  const Json::json_pointer frame("/header/frame_id"), sec("/header/stamp/sec");
  for (const auto& [place, value, words] : std::vector<std::tuple<Json::json_pointer, Json, const char*>>{
           {Json::json_pointer("/encoding"), "rgb8", "rgb8"},
           {Json::json_pointer("/height"), image.at("height").get<int>() + 1, "its camera has"},
           {Json::json_pointer("/data"), pixels.substr(1), "holds"},
           {Json::json_pointer("/step"), 0xffffffffU, "rows of"},
           {frame, "nowhere", "nowhere"},
           {sec, 1, "pose"}}) {
    Json bad = image;
    bad[place] = value;
    EXPECT_THAT(refused("refused", words, [&] { player->publish(image_topic, bad); }), HasSubstr(words));
  }
  const std::string whole = encoded("sensor_msgs/Image", image);
  for (const std::string& bytes :
       {whole.substr(0, 8), whole.substr(0, 21), whole.substr(0, whole.size() - 1000),
        std::string("\0\3", 2) + whole.substr(2)})  // a parameter list
    EXPECT_NE(refused("refused", "truncated", [&] { player->publish(image_topic, bytes); }), "");

  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [topic, place, value] : {std::tuple("/tf", "/transforms/0/transform/translation/x", nan),
                                            {"/tf", "/transforms/0/transform/rotation/w", 3.},
                                            {"/camera/depth/camera_info", "/k/0", nan}}) {
    Json bad = player->first(topic);
    bad[Json::json_pointer(place)] = value;
    refused("messages_refused", place, [&, topic = topic] { player->publish(topic, bad); });
  }
  play_mapped(2, 6, 6);
  EXPECT_EQ(last_status().at("received").get<int>(), 6 + last_status().at("refused").get<int>());
  EXPECT_THAT(node->errors(), HasSubstr("refused: "));
  end();
  expect_live_is("offline");
}

/// A service's request that ends too early gets no answer, and the next one does.
TEST_F(NodeTest, AnswersOnAfterABrokenRequest) {
  const Publisher raw(*vendor, "rq/octosurf/saveRequest", "Save_Request", Qos::reliable);
  start({"--depth", image_topic});
  ASSERT_TRUE(
      spoken_until([&] { raw.publish(std::string("\0\1\0\0abc", 7)); },
                   [&] { return node->errors().find("request of /octosurf/save") != std::string::npos; }));
  EXPECT_EQ(Client(*vendor, "/octosurf/save", "Save").call().at("success"), true);
  EXPECT_TRUE(exists("live.surfaces"));
}

/// A depth camera's full rate: 640×480 at 30 Hz for two seconds. Counted is what reaches the node's queue.
class Rate : public NodeTest {
 protected:
  static constexpr int images = 60;

  /// Publishes; returns what the node tells when nothing comes any more.
  Json publish_images(Qos qos, std::vector<std::string> options) {
    const Publisher publisher(*vendor, "rt" + image_topic, "sensor_msgs/Image", qos, images);
    options.insert(options.end(), {"--depth", image_topic});
    start(options);
    EXPECT_TRUE(wait_until([&] { return last_status().at("scan_publishers") == 1; })) << node->errors();
    Json image{{"width", 640}, {"height", 480}, {"step", 1280}, {"encoding", "16UC1"}};
    image["header"] = {{"frame_id", "camera"}, {"stamp", {{"sec", 0}}}};
    image["data"] = std::string(614400, '\1');
    // The first one to be heard does not count.
    EXPECT_TRUE(
        spoken_until([&] { publisher.publish(image); }, [&] { return last_status().at("received") > 0; }));
    const auto first = last_status().at("received").get<int>();
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < images; ++i) {
      image["header"]["stamp"]["sec"] = i + 1;
      const std::string bytes = encoded("sensor_msgs/Image", image);
      std::this_thread::sleep_until(begin + i * std::chrono::microseconds(33333));
      EXPECT_TRUE(publisher.publish(bytes));
    }
    Json last = last_status();
    int same = 0;  // for half a second, or until all has come
    wait_until([&] {
      const Json now = last_status();
      same = now.at("received") == last.at("received") ? same + 1 : 0;
      last = now;
      return now.at("received") == first + images || same == 250;
    });
    last["received"] = last.at("received").get<int>() - first;
    std::cout << "received " << last.at("received") << " of " << images << ", reported lost "
              << last.at("lost") << ", dropped " << last.at("dropped") << "\n";
    return last;
  }
};

TEST_F(Rate, OfADepthCameraArrivesWhole) {
  const Json last = publish_images(Qos::reliable, {"--reliable", "--wait", "0"});
  EXPECT_EQ(last.at("received"), images);
  EXPECT_EQ(last.at("dropped"), 0);
}

TEST_F(Rate, BestEffortTellsOfWhatIsLost) {
  const Json last = publish_images(Qos::best_effort, {"--wait", "0"});
  EXPECT_GT(last.at("received"), 0);
  EXPECT_LE(last.at("received").get<int>() + last.at("lost").get<int>(), images);
  EXPECT_EQ(last.at("dropped"), 0);
}

TEST_F(Rate, BeyondTheQueueDropsAndTells) {
  // Of a queue that holds one image all but the last make way while the mapper waits for a pose of the first.
  const Json last = publish_images(Qos::reliable, {"--reliable", "--queue", "1", "--wait", "60"});
  EXPECT_EQ(last.at("received"), images);
  EXPECT_GE(last.at("dropped"), images - 1);
  EXPECT_EQ(last.at("waiting"), 1);
}

/// What is published is what lies about the robot; the rest is to be had on request.
TEST_F(NodeTest, PublishesWhatLiesAboutTheRobotAndEverythingOnRequest) {
  start_heard({"--depth", image_topic, "--reliable", "--radius", "1", "--base", "camera"}, Qos::reliable);
  if (HasFatalFailure()) return;
  Subscription surfaces(*vendor, "rt/octosurf/surfaces", "octosurf_msgs/Surfaces", Qos::latched),
      octomap(*vendor, "rt/octosurf/octomap_binary", "octomap_msgs/Octomap", Qos::latched),
      patch(*vendor, "rt/octosurf/patch", "grid_map_msgs/GridMap", Qos::best_effort);
  play_mapped(0, player->scans(), player->scans());
  const auto revision = last_status().at("revision").get<std::uint64_t>();
  ASSERT_TRUE(wait_until([&] { return surfaces.last().at("revision") == revision && octomap.count() > 0; }));
  const Json near = surfaces.last().at("surfaces");
  const std::size_t near_bytes = octomap.last_bytes().size();
  // About the robot: its place is the middle of its patch.
  const int patches = patch.count();  // some are of poses on the way
  ASSERT_TRUE(wait_until([&] { return patch.count() > patches + 2; })) << node->errors();
  EXPECT_EQ(patch.last().at("layers"), Json({"elevation", "cell", "slope", "edge"}));
  Json place = patch.last().at("info").at("pose").at("position");
  const double x = place.at("x"), y = place.at("y"), z = 0;  // of the floor
  std::ostringstream box;
  box << "query offline --json --box";
  for (const double side : {-1.13, 1.13})  // the box follows when the robot has moved by an eighth
    box << ' ' << x + side << ' ' << y + side << ' ' << z + 1.5 + 2 * side;
  const auto within = Json::parse(run_well(box.str()).out).at("surfaces").get<std::vector<std::uint32_t>>();
  std::vector<std::uint32_t> ids;
  for (const Json& surface : near) ids.push_back(surface.at("id"));
  EXPECT_TRUE(std::ranges::includes(within, ids)) << ::testing::PrintToString(ids);
  const std::size_t all = info("offline").at("surfaces");
  EXPECT_LT(ids.size(), all);
  EXPECT_FALSE(ids.empty());
  // Nothing is published while nothing changes.
  const int count = surfaces.count() + octomap.count(), rounds = status->count();
  ASSERT_TRUE(wait_until([&] { return status->count() > rounds + 5; }));
  EXPECT_EQ(surfaces.count() + octomap.count(), count);

  Client publish(*vendor, "/octosurf/publish", "Publish");
  ASSERT_EQ(publish.call().at("success"), true);
  EXPECT_TRUE(wait_until([&] { return surfaces.last().at("surfaces").size() == all; }));
  EXPECT_TRUE(wait_until([&] { return octomap.last_bytes().size() > 2 * near_bytes; }));
  EXPECT_GT(last_status().at("published_bytes"), near_bytes);
  EXPECT_GT(last_status().at("publish_ms"), 0);
  EXPECT_EQ(publish.call({{"radius", -1}}).at("success"), false);

  Client changes(*vendor, "/octosurf/changes", "Changes");
  const auto changed = [&](const Json& asked) {
    return changes.call(asked).at("changed").at("surfaces").size();
  };
  EXPECT_EQ(changed(Json::object()), all);
  const auto point = [](double px, double py, double pz) { return Json{{"x", px}, {"y", py}, {"z", pz}}; };
  const auto below = changed({{"low", point(x, y, z + 1)}, {"high", point(x + 2, y, z - 1)}});
  EXPECT_GT(below, 0u);
  EXPECT_LT(below, all);
  EXPECT_EQ(changed({{"since", revision}}), 0u);
  EXPECT_EQ(changes.call({{"since", revision + 1}}).at("success"), false);

  const Json cleared = Client(*vendor, "/octosurf/clear", "Clear").call({{"size", point(100, 100, 100)}});
  ASSERT_EQ(cleared.at("success"), true) << cleared;
  EXPECT_THAT(cleared.at("message").get<std::string>(), HasSubstr(std::to_string(all) + " surfaces gone"));
  EXPECT_GT(cleared.at("revision"), revision);
  EXPECT_TRUE(wait_until([&] { return surfaces.last().at("surfaces").empty(); }));
  EXPECT_EQ(changes.call({{"since", revision}}).at("gone").size(), all);
  end();
}

TEST_F(NodeTest, SaysWhatIsWrongWithItsUse) {
  write("there.surfaces", "");
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"-o", "m"},
                                             {"-o", "m", "--depth", "no_slash"},
                                             {"-o", "m", "--depth", "/d", "--cloud", "/c"},
                                             {"-o", "m", "--cloud", "/c", "--hit", "-1"},
                                             {"-o", "there", "--cloud", "/c"}}) {
    Running wrong(folder, arguments, paths::dds_node());
    EXPECT_EQ(wrong.wait(), 2) << ::testing::PrintToString(arguments);
    EXPECT_NE(wrong.errors(), "");
  }
}

/// A node that has mapped the recording, and goes on; shared by all tests that only query it.
class MappedRoom : public NodeTest {
 public:
  MappedRoom() {
    SetUp();
    if (IsSkipped()) return;
    start_heard({"--depth", image_topic, "--reliable", "--foot-radius", "0.05", "--max-slope", "20",
                 "--clearance", "0.3"},
                Qos::reliable);
    if (HasFatalFailure()) return;
    play_mapped(0, player->scans(), player->scans());
    query = std::make_unique<Client>(*vendor, "/octosurf/query", "Query");
    regions = std::make_unique<Client>(*vendor, "/octosurf/contact_regions", "ContactRegions");
    offline = info("offline");
  }
  void TestBody() override {}

  using NodeTest::end, NodeTest::folder, NodeTest::read, NodeTest::read_json, NodeTest::info,
      NodeTest::map_offline, NodeTest::run_well, NodeTest::vendor, NodeTest::last_status, NodeTest::status;
  /// The last map that the node has published on a topic, for one who comes when all is over.
  std::string latched(const std::string& topic, const std::string& type) const {
    const Subscription subscription(*vendor, "rt/octosurf/" + topic, type, Qos::latched);
    EXPECT_TRUE(wait_until([&] { return subscription.count() > 0; })) << topic;
    return subscription.last_bytes();
  }
  /// What `octosurf query` says of the same map.
  Json query_offline(const std::string& asked) const {
    return Json::parse(run_well("query offline --json " + asked).out);
  }
  /// A place on the floor, queried from 2 m above.
  Json floor() const {
    Json found;
    for (double x = -3; x < 6; x += 0.5)
      for (double y = -3; y < 6; y += 0.5)
        if ((found = query->call({{"kind", 1}, {"point", {{"x", x}, {"y", y}, {"z", 2}}}})).at("found") ==
            true)
          return found;
    return found;
  }

  /// Of the recording's scans.
  Json last_stamp() const { return player->last(image_topic).at("header").at("stamp"); }

  std::unique_ptr<Client> query, regions;
  Json offline;
};

class LiveMap : public ::testing::Test {
 protected:
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

  static std::unique_ptr<MappedRoom> room;
  bool used_up = false;  ///< the node has ended, or has another map than the other tests expect
};

std::unique_ptr<MappedRoom> LiveMap::room;

TEST_F(LiveMap, IsPublishedAsTheOfflineMap) {
  // The other outputs are written after this one of the same round, and status after all.
  Subscription surfaces(*room->vendor, "rt/octosurf/surfaces", "octosurf_msgs/Surfaces", Qos::latched);
  ASSERT_TRUE(
      wait_until([&] { return surfaces.last().at("revision") == room->last_status().at("revision"); }));
  const int before = room->status->count();
  ASSERT_TRUE(wait_until([&] { return room->status->count() > before + 1; }));

  room->run_well("export offline --as-mapped --to offline.json");
  const Json expected = room->read_json("offline.json"), published = surfaces.last(),
             last = room->last_status();
  const Json stamp = last.at("header").at("stamp");
  EXPECT_EQ(stamp, room->last_stamp());
  EXPECT_GT(last.at("scan_ms"), 0);
  EXPECT_EQ(last.at("contradiction"), "");
  EXPECT_EQ(published.at("header"), Json({{"frame_id", "map"}, {"stamp", stamp}}));
  std::map<int, double> areas, expected_areas;
  for (const Json& one : published.at("surfaces")) areas[one.at("id")] = one.at("area");
  for (const Json& one : expected.at("surfaces")) expected_areas[one.at("id")] = one.at("area_m2");
  EXPECT_EQ(areas, expected_areas);

  const Json stairs = decoded("octosurf_msgs/Stairs", room->latched("stairs", "octosurf_msgs/Stairs"));
  EXPECT_EQ(stairs.at("header"), published.at("header"));
  EXPECT_EQ(stairs.at("revision"), published.at("revision"));
  EXPECT_EQ(stairs.at("stairs").size(), expected.at("stairs").size());
  EXPECT_EQ(stairs.at("single_steps").size(), expected.at("steps").size());
  const std::string marker_type = "visualization_msgs/MarkerArray";
  const Json markers = decoded(marker_type, room->latched("markers", marker_type)).at("markers");
  EXPECT_EQ(markers.size(), areas.size() + 1);
  EXPECT_EQ(markers.back().at("header").at("stamp"), stamp);

  // As the library has them of the map that is offline.
  const Map map = load_map(room->folder / "offline").map;
  planning::ContactQuestion question;
  question.max_slope_rad = 20 * degree;
  question.clearance_m = 0.3;
  GroundRules rules = planning::rules_of(question, up_of(map).direction, map.octree().resolution());
  rules.foot = ContactShape::disc(0.05);
  const GroundView ground(map.snapshot(), map.octree(), rules);
  PlannerContact contact;
  contact.shape = rules.foot;
  contact.limits = rules.limits;
  HeightGridOptions wanted;
  wanted.max_slope_rad = 20 * degree;
  const HeightGrid grid = height_grid(*ground.solid(), wanted);
  const auto expect_message = [&](const char* topic, const std::string& type,
                                  const std::string& expected_bytes, const char* header) {
    Json message = decoded(type, room->latched(topic, type));
    Json& of_message = message[Json::json_pointer(header)];
    EXPECT_EQ(of_message.at("stamp"), stamp) << topic;
    of_message["stamp"] = {{"sec", 0}, {"nanosec", 0}};  // the library's are of no time
    EXPECT_TRUE(encoded(type, message) == expected_bytes) << topic;
  };
  const auto terrain = planner_surfaces(*ground.solid(), contact, &ground.octree());
  expect_message("planar_terrain", "convex_plane_decomposition_msgs/PlanarTerrain",
                 planar_terrain_message(terrain, grid, "map"), "/gridmap/header");
  expect_message("grid_map", "grid_map_msgs/GridMap", grid_map_message(grid, "map"), "/header");
}

TEST_F(LiveMap, HasAnOctomapThatOctomapReadsAndWritesAgain) {
  Subscription octomap(*room->vendor, "rt/octosurf/octomap_binary", "octomap_msgs/Octomap", Qos::latched);
  octomap::OcTree expected((room->folder / "offline.bt").string());
  EXPECT_TRUE(wait_until([&] {
    if (octomap.count() == 0) return false;
    const Json message = octomap.last();
    EXPECT_EQ(message.at("binary"), true);
    EXPECT_EQ(message.at("id"), "OcTree");
    EXPECT_EQ(message.at("header").at("stamp"), room->last_stamp());
    octomap::OcTree tree(message.at("resolution").get<double>());
    std::stringstream data(message.at("data").get<std::string>());
    tree.readBinaryData(data);
    std::ostringstream again;
    tree.writeBinaryData(again);
    EXPECT_TRUE(again.str() == data.str());
    tree.prune();
    return tree == expected;
  }));
}

TEST_F(LiveMap, AnswersAboutPlacesAreThoseOfTheOfflineMap) {
  enum Kind : std::uint8_t { nearest, below, ray, sphere, box, voxel, ground };
  const auto point = [](double x, double y, double z) { return Json{{"x", x}, {"y", y}, {"z", z}}; };
  const auto question = [&](int kind, double x, double y, double z, Json more = Json::object()) {
    more.update(Json{{"kind", kind}, {"point", point(x, y, z)}});
    return more;
  };
  const auto words = [](const char* option, const std::vector<double>& numbers) {
    std::ostringstream text;
    text.precision(17);
    text << option;
    for (const double number : numbers) text << ' ' << number;
    return text.str();
  };
  const Json on_floor = room->floor();
  ASSERT_EQ(on_floor.at("found"), true) << on_floor;
  EXPECT_EQ(on_floor.at("revision"), room->offline.at("revision"));
  const double x = on_floor.at("point").at("x"), y = on_floor.at("point").at("y"),
               z = on_floor.at("point").at("z");
  const std::vector<std::pair<Json, std::string>> all{
      {question(below, x, y, 2), words("--below", {x, y, 2})},
      {question(nearest, x, y, 2), words("--nearest", {x, y, 2})},
      {question(ray, x, y, 2, {{"direction", point(0, 0, -1)}}), words("--ray", {x, y, 2, 0, 0, -1})},
      {question(sphere, x, y, z, {{"distance", 1.5}}), words("--sphere", {x, y, z, 1.5})},
      {question(box, x, y, z, {{"corner", point(x - 1, y + 2, z - 0.5)}}),
       words("--box", {x - 1, y, z - 0.5, x, y + 2, z})},
      {question(voxel, x, y, z), words("--voxel", {x, y, z})},
      {question(voxel, x, y, z + 0.5), words("--voxel", {x, y, z + 0.5})},
      {question(voxel, x, y, 9), words("--voxel", {x, y, 9})}};
  const std::vector<std::string> states{"unknown", "free", "occupied"};
  for (const auto& [asked, in_words] : all) {
    SCOPED_TRACE(in_words);
    const Json there = room->query->call(asked), known = room->query_offline(in_words);
    const auto number = [&](const char* place, double other) {
      const Json::json_pointer at(place);
      return known.contains(at) && known.at(at).is_number() ? known.at(at).get<double>() : other;
    };
    Json surfaces = known.value("surfaces", Json::array());
    if (const auto id = number("/surface", 0); id > 0) surfaces = {id};
    EXPECT_EQ(there.at("surfaces"), surfaces);
    EXPECT_EQ(states.at(there.at("state")), known.value("state", "unknown"));
    EXPECT_NEAR(there.at("log_odds"), number("/log_odds", 0), 1e-5);
    EXPECT_EQ(there.at("found"), known.contains("distance_m"));
    EXPECT_NEAR(there.at("distance"), number("/distance_m", 0), 1e-6);
    EXPECT_NEAR(there.at("normal").at("z"), number("/normal/2", there.at("normal").at("z")), 1e-6);
    EXPECT_EQ(there.at("front"), known.value("side", "back") == "front");
  }

  const Json stands = room->query->call(question(ground, x, y, z + 0.1));
  EXPECT_EQ(stands.at("found"), true) << stands;
  EXPECT_EQ(stands.at("surfaces"), on_floor.at("surfaces"));
  EXPECT_EQ(stands.at("ground"), "supported");
  EXPECT_NEAR(stands.at("distance"), 0.1, 0.02);
  const auto outside = [&](const Json& surface) {
    return room->query->call(question(ground, x + 200, y, z, {{"surface", surface}}));
  };
  EXPECT_EQ(outside(on_floor.at("surfaces")[0]).at("ground"), "unseen");
  EXPECT_EQ(outside(1'000'000).at("success"), false);
  EXPECT_THAT(room->query->call(question(77, x, y, z)).at("message").get<std::string>(),
              HasSubstr("octosurf_msgs/Query"));
}

TEST_F(LiveMap, AnswersAboutContactsAndPlans) {
  const Json on_floor = room->floor();
  ASSERT_EQ(on_floor.at("found"), true) << on_floor;
  const Json floor = on_floor.at("surfaces").at(0);
  Json contact{{"surface", floor},
               {"length", 0.22},
               {"width", 0.11},
               {"any_heading", true},
               {"max_slope", std::numbers::pi},
               {"pieces", 3}};
  const auto regions = [&] { return room->regions->call(contact).at("regions"); };
  const auto area = [&] { return regions().at(0).at("area").get<double>(); };
  const Json found = regions();
  ASSERT_EQ(found.size(), 1u);
  const Json expected =
      room->query_offline("--regions " + floor.dump() + " --foot 0.22x0.11 --max-slope 180 --pieces 3");
  EXPECT_NEAR(found[0].at("area"), expected.at("area_m2").get<double>(), 1e-8);
  EXPECT_EQ(found[0].at("pieces").size(), expected.at("pieces").size());
  contact.update(Json{{"about", on_floor.at("point")}, {"reach", 0.5}});
  EXPECT_GT(area(), 0);
  EXPECT_LT(area(), std::min(found[0].at("area").get<double>(), 1 + 1e-9));
  contact.update(Json{{"reach", 0}, {"as_mapped", true}});
  EXPECT_GT(area(), found[0].at("area").get<double>());
  contact["surface"] = 0;
  EXPECT_EQ(regions().size(), room->offline.at("surfaces"));
  contact["length"] = -1;
  EXPECT_EQ(room->regions->call(contact).at("success"), false);

  Client plan(*room->vendor, "/octosurf/plan", "Plan");
  EXPECT_THAT(plan.call({{"robot", "snake"}}).at("message").get<std::string>(), HasSubstr("quadruped"));
  const Json nowhere = plan.call({{"robot", "biped"}, {"start", {{"x", 100}}}});  // nothing to stand on
  EXPECT_EQ(nowhere.at("success"), true);
  EXPECT_EQ(nowhere.at("found"), false);
  EXPECT_NE(nowhere.at("message"), "");

  // Where half a metre of floor is about the robot it can stand, and make a step.
  contact = {{"radius", 0.5}, {"any_heading", true}, {"max_slope", 0.1}};
  const Json open_floor = regions();
  const auto place =
      std::ranges::find_if(open_floor, [](const Json& region) { return !region.at("polygons").empty(); });
  ASSERT_NE(place, open_floor.end());
  const Json start = place->at("polygons")[0].at("outer").at("points")[0];
  Json goal = start;
  goal["x"] = start.at("x").get<double>() + 0.15;
  const Json steps = plan.call({{"robot", "biped"}, {"start", start}, {"goal", goal}, {"time_limit", 600}});
  ASSERT_EQ(steps.at("found"), true) << steps;
  EXPECT_EQ(steps.at("start").size(), 2u);
  EXPECT_GT(steps.at("steps").size(), 0u);
  EXPECT_GE(steps.at("cost"), steps.at("lower_bound"));
  for (const Json& step : steps.at("steps")) {
    EXPECT_EQ(step.at("surface"), place->at("surface"));
    EXPECT_GT(step.at("margin"), 0);
  }
}

TEST_F(LiveMap, IsSavedAndLoadedBesideTheNodesOwnOnly) {
  Client save(*room->vendor, "/octosurf/save", "Save"), load(*room->vendor, "/octosurf/load", "Load");
  const auto answer = [](Client& client, const Json& asked) {
    return client.call(asked).at("message").get<std::string>();
  };
  for (const std::string name : {"../x", "/tmp/x", ".x", "a/b"})
    EXPECT_THAT(answer(save, {{"file", name}}), HasSubstr("plain name")) << name;
  EXPECT_THAT(answer(save, {{"file", "other"}}), HasSubstr("other: "));
  EXPECT_TRUE(room->read("other.surfaces") == room->read("offline.surfaces"));
  room->map_offline("first", "--first 1");
  const std::string before = room->read("first.surfaces");
  EXPECT_EQ(load.call({{"file", "none"}}).at("success"), false);
  EXPECT_EQ(room->info("other").at("revision"), room->last_status().at("revision"));
  EXPECT_THAT(answer(load, {{"file", "first"}}), HasSubstr("no longer as live"));
  const Json revision = room->info("first").at("revision");
  EXPECT_TRUE(wait_until([&] { return room->last_status().at("revision") == revision; }));
  EXPECT_THAT(answer(save, Json::object()), HasSubstr("first: "));  // it is the node's own now
  room->end();
  EXPECT_TRUE(room->read("first.surfaces") == before);
  used_up = true;
}

}  // namespace
}  // namespace octosurf::test
