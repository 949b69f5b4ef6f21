// The node beside a robot of another vendor, over the loopback.
#include "dds/robot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <numbers>
#include <octomap/OcTree.h>
#include <sstream>

namespace octosurf::test {
namespace {

using octosurf_msgs::msg::dds_::Stairs_PubSubType;
using octosurf_msgs::msg::dds_::Surfaces_PubSubType;
using sensor_msgs::msg::dds_::CameraInfo_PubSubType;
using sensor_msgs::msg::dds_::Image_PubSubType;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAreArray;

const std::string image_topic = "/camera/depth/image";

/// Until all that has come was mapped, refused or dropped, and that was `mapped` mapped.
bool has_mapped(const Status& status, std::uint64_t mapped) {
  return wait_until([&] { return status.last().mapped() == mapped && status.last().waiting() == 0; });
}

TEST_F(NodeTest, MapsSavesIsKilledAndGoesOnToTheMapOfTheRecording) {
  record("--frames 8", "");
  if (HasFatalFailure()) return;
  Player player(*vendor, folder / "walk.db3", Qos::best_effort);
  ASSERT_EQ(player.scans(), 8u);
  {
    const auto node = start({"--depth", image_topic, "-o", "live", "--checkpoint", "0"});
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    SaveClient save(*vendor, "/octosurf/save");
    ASSERT_TRUE(player.is_heard(status)) << node->errors();
    player.play(0, 5);
    ASSERT_TRUE(has_mapped(status, 5)) << node->errors() << status.last().last_refusal();
    const auto saved = save.call({});
    EXPECT_TRUE(saved.success()) << saved.message();
    node->send(SIGKILL);
    EXPECT_EQ(node->wait(), 128 + SIGKILL);
  }
  run_well("map walk.db3 -o half --first 5 --detection-budget 0 --forget-scans");
  EXPECT_TRUE(read("live.surfaces") == read("half.surfaces"));
  {
    const auto node = start({"--depth", image_topic, "-o", "live", "--resume"});
    Status status(*vendor, "rt/octosurf/status", Qos::latched);
    ASSERT_TRUE(player.is_heard(status)) << node->errors();
    player.play(5, 8);
    ASSERT_TRUE(has_mapped(status, 3)) << node->errors();
    EXPECT_EQ(end(*node), 0) << node->errors();
  }
  EXPECT_TRUE(read("live.surfaces") == read("offline.surfaces"));
  EXPECT_TRUE(read("live.bt") == read("offline.bt"));
}

TEST_F(NodeTest, MapsCloudsByAChainOfTransforms) {
  record("--sensor spinning --frames 3", "poses=chain");
  if (HasFatalFailure()) return;
  const std::string whole = read("offline.surfaces");
  run_well(
      "map walk.db3 -o offline --force --self-box imu -1 -1.5 -3 1.5 1 3 --detection-budget 0 "
      "--forget-scans");
  ASSERT_TRUE(read("offline.surfaces") != whole);
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node = start({"--cloud", "/lidar/points", "-o", "live", "--reliable", "--self-box", "imu", "-1",
                           "-1.5", "-3", "1.5", "1", "3"});
  Status status(*vendor, "rt/octosurf/status", Qos::latched);
  ASSERT_TRUE(player.is_heard(status)) << node->errors();
  player.play(0, player.scans());
  ASSERT_TRUE(has_mapped(status, player.scans())) << node->errors();
  EXPECT_EQ(end(*node), 0) << node->errors();
  EXPECT_TRUE(read("live.surfaces") == read("offline.surfaces"));
  EXPECT_TRUE(read("live.bt") == read("offline.bt"));
}

TEST_F(NodeTest, SaysWhatIsWrongWithItsUse) {
  write("there.surfaces", "");
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"-o", "m"},
                                             {"-o", "m", "--depth", "no_slash"},
                                             {"-o", "m", "--depth", "/d", "--cloud", "/c"},
                                             {"-o", "m", "--cloud", "/c", "--resolution", "-1"},
                                             {"-o", "there", "--cloud", "/c"}}) {
    const auto node = start(arguments);
    EXPECT_EQ(node->wait(), 2) << ::testing::PrintToString(arguments);
    EXPECT_NE(node->errors(), "");
  }
}

class Outputs : public NodeTest {
 protected:
  /// A node that has mapped the recording, started with `options`, too.
  void map(const std::vector<std::string>& options = {}) {
    record("--frames 6", "");
    if (HasFatalFailure()) return;
    Player player(*vendor, folder / "walk.db3", Qos::reliable);
    std::vector<std::string> arguments{"--depth", image_topic, "-o", "live", "--reliable"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    node = start(arguments);
    status = std::make_unique<Status>(*vendor, "rt/octosurf/status", Qos::latched);
    ASSERT_TRUE(player.is_heard(*status)) << node->errors();
    player.play(0, player.scans());
    ASSERT_TRUE(has_mapped(*status, player.scans())) << node->errors();
    offline = info("offline");
    for (const Player::Message& message : player.messages())
      if (message.topic == image_topic)
        last_stamp = deserialised<Image_PubSubType>(message.cdr).header().stamp();
  }
  /// The last map that the node has published on a topic, for one who comes when all is over.
  template <class Support>
  typename Support::type latched(const std::string& topic) {
    Subscription<Support> subscription(*vendor, "rt/octosurf/" + topic, Qos::latched);
    EXPECT_TRUE(wait_until([&] { return subscription.count() > 0; })) << topic;
    return subscription.last();
  }

  std::unique_ptr<Running> node;
  std::unique_ptr<Status> status;
  nlohmann::json offline;
  builtin_interfaces::msg::dds_::Time_ last_stamp;  // of its scans
};

TEST_F(Outputs, AreThoseOfTheOfflineMap) {
  map({"--foot-radius", "0.05", "--max-slope", "20", "--clearance", "0.3", "--gap-depth", "0.03"});
  if (HasFatalFailure() || IsSkipped()) return;
  // The other outputs are written after this one of the same round, and status after all.
  Subscription<Surfaces_PubSubType> surfaces(*vendor, "rt/octosurf/surfaces", Qos::latched);
  ASSERT_TRUE(wait_until([&] { return surfaces.last().revision() == status->last().revision(); }));
  const int before = status->count();
  ASSERT_TRUE(wait_until([&] { return status->count() > before + 1; }));

  run_well("export offline --as-mapped --to offline.json");
  const nlohmann::json expected = read_json("offline.json");
  const auto published = surfaces.last();
  std::vector<double> areas, expected_areas;
  double total_area = 0;
  for (const auto& surface : published.surfaces()) areas.push_back(surface.area());
  for (const auto& surface : expected.at("surfaces")) expected_areas.push_back(surface.at("area_m2"));
  for (const double area : areas) total_area += area;
  EXPECT_THAT(areas, UnorderedElementsAreArray(expected_areas));
  EXPECT_EQ(published.header().frame_id(), "map");
  EXPECT_EQ(published.header().stamp(), last_stamp);
  EXPECT_EQ(status->last().header().stamp(), last_stamp);
  EXPECT_GT(status->last().scan_ms(), 0);
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

  const auto stairs = latched<Stairs_PubSubType>("stairs");
  EXPECT_EQ(stairs.revision(), published.revision());
  EXPECT_EQ(stairs.header().frame_id(), "map");
  EXPECT_EQ(stairs.stairs().size(), expected.at("stairs").size());
  ASSERT_EQ(stairs.single_steps().size(), expected.at("steps").size());
  for (std::size_t i = 0; i < stairs.single_steps().size(); ++i) {
    EXPECT_NEAR(stairs.single_steps()[i].riser(), expected.at("steps")[i].at("riser_m").get<double>(), 1e-4);
  }

  double shown_area = 0;
  const auto markers = latched<visualization_msgs::msg::dds_::MarkerArray_PubSubType>("markers");
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

  run_well(
      "export offline --format planar_terrain --to terrain.cdr --foot-radius 0.05 --max-slope 20 "
      "--clearance 0.3 --gap-depth 0.03");
  run_well("export offline --format grid_map --to grid.cdr --max-slope 20");
  using convex_plane_decomposition_msgs::msg::dds_::PlanarTerrain_PubSubType;
  using grid_map_msgs::msg::dds_::GridMap_PubSubType;
  EXPECT_TRUE(serialised<PlanarTerrain_PubSubType>(latched<PlanarTerrain_PubSubType>("planar_terrain")) ==
              read("terrain.cdr"));
  EXPECT_TRUE(serialised<GridMap_PubSubType>(latched<GridMap_PubSubType>("grid_map")) == read("grid.cdr"));
}

TEST_F(Outputs, HaveAnOctomapThatOctomapReadsAndWritesAgain) {
  map();
  if (HasFatalFailure() || IsSkipped()) return;
  using octomap_msgs::msg::dds_::Octomap_PubSubType;
  Subscription<Octomap_PubSubType> octomap(*vendor, "rt/octosurf/octomap_binary", Qos::latched);
  octomap::OcTree expected((folder / "offline.bt").string());
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

class Answers : public Outputs {
 protected:
  using Question = octosurf_msgs::srv::dds_::Query_Request_;
  using Answer = octosurf_msgs::srv::dds_::Query_Response_;
  using Regions = octosurf_msgs::srv::dds_::ContactRegions_Request_;

  void SetUp() override {
    Outputs::SetUp();
    if (IsSkipped()) return;
    map();
    if (HasFatalFailure()) return;
    using namespace octosurf_msgs::srv::dds_;
    query = std::make_unique<Client<Query_Request_PubSubType, Query_Response_PubSubType>>(*vendor,
                                                                                          "/octosurf/query");
    regions = std::make_unique<Client<ContactRegions_Request_PubSubType, ContactRegions_Response_PubSubType>>(
        *vendor, "/octosurf/contact_regions");
  }

  enum Kind : std::uint8_t { nearest, below, ray, sphere, box, voxel, ground };
  static Question question(Kind kind, double x, double y, double z) {
    Question question;
    question.kind(kind);
    question.point().x(x);
    question.point().y(y);
    question.point().z(z);
    return question;
  }
  /// A place on the floor, asked from 2 m up.
  Answer floor() {
    Answer found;
    for (double x = -3; !found.found() && x < 6; x += 0.5)
      for (double y = -3; !found.found() && y < 6; y += 0.5) found = query->call(question(below, x, y, 2));
    return found;
  }
  /// What `octosurf query` says of the same map.
  nlohmann::json offline_answer(const std::string& asked) const {
    return nlohmann::json::parse(run_well("query offline --json " + asked).out);
  }
  static std::string words(const std::vector<double>& numbers) {
    std::ostringstream text;
    text.precision(17);
    for (const double number : numbers) text << ' ' << number;
    return text.str();
  }

  std::unique_ptr<Client<octosurf_msgs::srv::dds_::Query_Request_PubSubType,
                         octosurf_msgs::srv::dds_::Query_Response_PubSubType>>
      query;
  std::unique_ptr<Client<octosurf_msgs::srv::dds_::ContactRegions_Request_PubSubType,
                         octosurf_msgs::srv::dds_::ContactRegions_Response_PubSubType>>
      regions;
};

TEST_F(Answers, AboutPlacesAreThoseOfTheOfflineMap) {
  const Answer on_floor = floor();
  ASSERT_TRUE(on_floor.found()) << on_floor.message();
  EXPECT_TRUE(on_floor.success());
  EXPECT_EQ(on_floor.revision(), offline.at("revision"));
  const double x = on_floor.point().x(), y = on_floor.point().y(), z = on_floor.point().z();
  const nlohmann::json expected = offline_answer("--below" + words({x, y, 2}));
  ASSERT_EQ(on_floor.surfaces().size(), 1u);
  EXPECT_EQ(expected.at("surface"), on_floor.surfaces()[0]);
  EXPECT_NEAR(expected.at("distance_m").get<double>(), on_floor.distance(), 1e-6);
  EXPECT_NEAR(expected.at("normal").at(2).get<double>(), on_floor.normal().z(), 1e-6);

  Question down = question(ray, x, y, 2);
  down.direction().z(-1);
  const Answer met = query->call(down);
  EXPECT_EQ(met.surfaces(), on_floor.surfaces());
  EXPECT_NEAR(met.distance(), on_floor.distance(), 1e-9);
  EXPECT_EQ(met.front(), offline_answer("--ray" + words({x, y, 2, 0, 0, -1})).at("side") == "front");

  Question near = question(sphere, x, y, z);
  near.distance(1.5);
  const auto ids = [](const nlohmann::json& of) {
    return of.at("surfaces").get<std::vector<std::uint32_t>>();
  };
  EXPECT_EQ(query->call(near).surfaces(), ids(offline_answer("--sphere" + words({x, y, z, 1.5}))));
  Question boxed = question(box, x, y, z);
  boxed.corner().x(x - 1);
  boxed.corner().y(y + 2);
  boxed.corner().z(z - 0.5);
  EXPECT_EQ(query->call(boxed).surfaces(),
            ids(offline_answer("--box" + words({x - 1, y, z - 0.5, x, y + 2, z}))));
  const std::vector<std::string> states{"unknown", "free", "occupied"};
  for (const double height : {0.0, 0.5, 9.0}) {
    const Answer there = query->call(question(voxel, x, y, z + height));
    const nlohmann::json known = offline_answer("--voxel" + words({x, y, z + height}));
    EXPECT_EQ(states.at(there.state()), known.at("state").get<std::string>());
    if (there.state() != 0) {
      EXPECT_NEAR(there.log_odds(), known.at("log_odds").get<double>(), 1e-5);
    }
  }
  const Answer stands = query->call(question(ground, x, y, z + 0.1));
  EXPECT_TRUE(stands.success() && stands.found()) << stands.message();
  EXPECT_EQ(stands.surfaces(), on_floor.surfaces());
  EXPECT_EQ(stands.ground(), "supported");
  EXPECT_NEAR(stands.distance(), 0.1, 0.02);
  Question outside = question(ground, x + 200, y, z);
  outside.surface(on_floor.surfaces()[0]);
  EXPECT_EQ(query->call(outside).ground(), "unseen");
  outside.surface(1'000'000);
  EXPECT_FALSE(query->call(outside).success());
  Question nonsense = question(nearest, x, y, z);
  nonsense.kind(77);
  EXPECT_FALSE(query->call(nonsense).success());
  EXPECT_THAT(query->call(nonsense).message(), HasSubstr("octosurf_msgs/Query"));
}

TEST_F(Answers, AboutContactsAndPlans) {
  const Answer on_floor = floor();
  ASSERT_TRUE(on_floor.found()) << on_floor.message();
  Regions contact;
  contact.surface(on_floor.surfaces().at(0));
  contact.length(0.22);
  contact.width(0.11);
  contact.any_heading(true);
  contact.max_slope(std::numbers::pi);
  contact.pieces(3);
  const auto found = regions->call(contact);
  ASSERT_TRUE(found.success()) << found.message();
  ASSERT_EQ(found.regions().size(), 1u);
  const nlohmann::json expected = offline_answer("--regions " + std::to_string(on_floor.surfaces()[0]) +
                                                 " --foot 0.22x0.11 --max-slope 180 --pieces 3");
  EXPECT_NEAR(found.regions()[0].area(), expected.at("area_m2").get<double>(), 1e-8);
  EXPECT_EQ(found.regions()[0].pieces().size(), expected.at("pieces").size());
  contact.surface(0);
  EXPECT_EQ(regions->call(contact).regions().size(), offline.at("surfaces").get<std::size_t>());
  contact.length(-1);
  EXPECT_FALSE(regions->call(contact).success());

  using namespace octosurf_msgs::srv::dds_;
  Client<Plan_Request_PubSubType, Plan_Response_PubSubType> plan(*vendor, "/octosurf/plan");
  Plan_Request_ way;
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
  const auto open_floor = regions->call(open).regions();
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

TEST_F(Outputs, SaveAndLoadBesideTheNodesOwnMapOnly) {
  map();
  if (HasFatalFailure() || IsSkipped()) return;
  namespace srv = octosurf_msgs::srv::dds_;
  SaveClient save(*vendor, "/octosurf/save");
  Client<srv::Load_Request_PubSubType, srv::Load_Response_PubSubType> load(*vendor, "/octosurf/load");
  srv::Save_Request_ other;
  for (const std::string name : {"../x", "/tmp/x", ".x", "a/b"}) {
    other.file(name);
    EXPECT_THAT(save.call(other).message(), HasSubstr("plain name")) << name;
  }
  other.file("other");
  EXPECT_THAT(save.call(other).message(), HasSubstr("other: "));
  EXPECT_TRUE(read("other.surfaces") == read("offline.surfaces"));
  run_well("map walk.db3 -o first --first 1");
  const std::string before = read("first.surfaces");
  srv::Load_Request_ first;
  first.file("none");
  EXPECT_FALSE(load.call(first).success());
  EXPECT_EQ(info("other").at("revision"), status->last().revision());
  first.file("first");
  const auto loaded = load.call(first);
  EXPECT_TRUE(loaded.success()) << loaded.message();
  EXPECT_TRUE(wait_until([&] { return info("first").at("revision") == status->last().revision(); }));
  EXPECT_THAT(save.call({}).message(), HasSubstr("first: "));  // it is the node's own now
  EXPECT_EQ(end(*node), 0);
  EXPECT_TRUE(read("first.surfaces") == before);
}

}  // namespace
}  // namespace octosurf::test
