// The node beside a robot of another vendor, over the loopback.
#include "dds/robot.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <octomap/OcTree.h>
#include <sstream>

namespace octosurf::test {
namespace {

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
  run_well("map walk.db3 -o half --first 5");
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
  Player player(*vendor, folder / "walk.db3", Qos::reliable);
  const auto node = start({"--cloud", "/lidar/points", "-o", "live", "--reliable"});
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
  /// A node that has mapped the recording.
  void map() {
    record("--frames 6", "");
    if (HasFatalFailure()) return;
    Player player(*vendor, folder / "walk.db3", Qos::reliable);
    node = start({"--depth", image_topic, "-o", "live", "--reliable"});
    status = std::make_unique<Status>(*vendor, "rt/octosurf/status", Qos::latched);
    ASSERT_TRUE(player.is_heard(*status)) << node->errors();
    player.play(0, player.scans());
    ASSERT_TRUE(has_mapped(*status, player.scans())) << node->errors();
    offline = info("offline");
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
};

TEST_F(Outputs, AreThoseOfTheOfflineMap) {
  map();
  if (HasFatalFailure() || IsSkipped()) return;
  // The other outputs are written after this one of the same round, and status after all.
  Subscription<Surfaces_PubSubType> surfaces(*vendor, "rt/octosurf/surfaces", Qos::latched);
  ASSERT_TRUE(wait_until([&] { return surfaces.last().revision() == status->last().revision(); }));
  const int before = status->count();
  ASSERT_TRUE(wait_until([&] { return status->count() > before + 1; }));

  run_well("export offline --to offline.json");
  const nlohmann::json expected = read_json("offline.json");
  std::vector<double> areas, expected_areas;
  double total_area = 0;
  for (const auto& surface : surfaces.last().surfaces()) areas.push_back(surface.area());
  for (const auto& surface : expected.at("surfaces")) expected_areas.push_back(surface.at("area_m2"));
  for (const double area : areas) total_area += area;
  EXPECT_THAT(areas, UnorderedElementsAreArray(expected_areas));
  EXPECT_EQ(surfaces.last().header().frame_id(), "map");

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

  run_well("export offline --format planar_terrain --to terrain.cdr");
  run_well("export offline --format grid_map --to grid.cdr");
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

TEST_F(Outputs, AnswerWhatIsAsked) {
  map();
  if (HasFatalFailure() || IsSkipped()) return;
  namespace srv = octosurf_msgs::srv::dds_;
  Client<srv::Query_Request_PubSubType, srv::Query_Response_PubSubType> query(*vendor, "/octosurf/query");
  const auto below = [&](double x, double y) {
    srv::Query_Request_ question;
    question.question(1);  // BELOW
    question.point().x(x);
    question.point().y(y);
    question.point().z(2);
    question.max_slope(std::numbers::pi);
    return query.call(question);
  };
  srv::Query_Response_ floor;
  Eigen::Vector2d at(0, 0);
  for (at.x() = -3; !floor.success() && at.x() < 6; at.x() += 0.5)
    for (at.y() = -3; !floor.success() && at.y() < 6; at.y() += 0.5) floor = below(at.x(), at.y());
  ASSERT_TRUE(floor.success()) << floor.message();
  std::ostringstream offline_question;
  offline_question << "query offline --json --below " << at.x() - 0.5 << ' ' << at.y() - 0.5 << " 2";
  const nlohmann::json expected = nlohmann::json::parse(run_well(offline_question.str()).out);
  EXPECT_EQ(expected.at("surface"), floor.surface());
  EXPECT_NEAR(expected.at("distance_m").get<double>(), floor.distance(), 1e-6);
  EXPECT_NEAR(expected.at("normal").at(2).get<double>(), floor.normal().z(), 1e-6);
  srv::Query_Request_ question;
  question.question(7);
  EXPECT_THAT(query.call(question).message(), HasSubstr("NEAREST"));

  Client<srv::ContactRegions_Request_PubSubType, srv::ContactRegions_Response_PubSubType> regions(
      *vendor, "/octosurf/contact_regions");
  srv::ContactRegions_Request_ contact;
  contact.surface(floor.surface());
  contact.foot_length(0.22);
  contact.foot_width(0.11);
  contact.any_yaw(true);
  contact.max_slope(std::numbers::pi);
  const auto found = regions.call(contact);
  ASSERT_TRUE(found.success()) << found.message();
  ASSERT_EQ(found.regions().size(), 1u);
  EXPECT_GT(found.regions()[0].area(), 0.1);
  contact.surface(0);
  EXPECT_EQ(regions.call(contact).regions().size(), offline.at("surfaces").get<std::size_t>());
  contact.foot_length(-1);
  EXPECT_FALSE(regions.call(contact).success());

  Client<srv::Plan_Request_PubSubType, srv::Plan_Response_PubSubType> plan(*vendor, "/octosurf/plan");
  srv::Plan_Request_ way;
  way.robot("snake");
  EXPECT_THAT(plan.call(way).message(), HasSubstr("quadruped"));
  way.robot("biped");
  way.start().x(100);  // where there is nothing to stand on
  const auto nowhere = plan.call(way);
  EXPECT_FALSE(nowhere.success());
  EXPECT_NE(nowhere.message(), "");

  // Where half a metre of floor is about the robot it can stand, and make a step.
  contact.foot_length(0.5);
  contact.foot_width(0);
  contact.max_slope(0.1);
  const auto open_floor = regions.call(contact).regions();
  const auto place = std::find_if(open_floor.begin(), open_floor.end(),
                                  [](const auto& region) { return !region.polygons().empty(); });
  ASSERT_NE(place, open_floor.end());
  const auto& pose = place->pose();
  const auto& corner = place->polygons()[0].outer().points()[0];
  const Eigen::Vector3d start =
      Eigen::Vector3d(pose.position().x(), pose.position().y(), pose.position().z()) +
      Eigen::Quaterniond(pose.orientation().w(), pose.orientation().x(), pose.orientation().y(),
                         pose.orientation().z()) *
          Eigen::Vector3d(corner.u(), corner.v(), 0);
  for (auto* end : {&way.start(), &way.goal()}) {
    end->x(start.x());
    end->y(start.y());
    end->z(start.z());
  }
  way.goal().x(start.x() + 0.15);
  const auto steps = plan.call(way);
  ASSERT_TRUE(steps.success()) << steps.message();
  EXPECT_GT(steps.steps().size(), 2u);  // the two feet as they stand, and what follows
  for (const auto& step : steps.steps()) EXPECT_EQ(step.surface(), place->surface());
}

TEST_F(Outputs, SaveAndLoadBesideTheNodesOwnMapOnly) {
  map();
  if (HasFatalFailure() || IsSkipped()) return;
  namespace srv = octosurf_msgs::srv::dds_;
  SaveClient save(*vendor, "/octosurf/save");
  Client<srv::Load_Request_PubSubType, srv::Load_Response_PubSubType> load(*vendor, "/octosurf/load");
  srv::Save_Request_ other;
  for (const std::string name : {"../x", "/tmp/x", ".x", "a/b"}) {
    other.name(name);
    EXPECT_THAT(save.call(other).message(), HasSubstr("plain name")) << name;
  }
  other.name("other");
  EXPECT_TRUE(save.call(other).success());
  EXPECT_TRUE(read("other.surfaces") == read("offline.surfaces"));
  run_well("map walk.db3 -o first --first 1");
  srv::Load_Request_ first;
  first.name("none");
  EXPECT_FALSE(load.call(first).success());
  EXPECT_EQ(info("other").at("revision"), status->last().revision());
  first.name("first");
  const auto loaded = load.call(first);
  EXPECT_TRUE(loaded.success()) << loaded.message();
  EXPECT_TRUE(wait_until([&] { return info("first").at("revision") == status->last().revision(); }));
  EXPECT_EQ(end(*node), 0);
  EXPECT_TRUE(read("live.surfaces") == read("first.surfaces"));
}

}  // namespace
}  // namespace octosurf::test
