// MCAP files as our own reader finds them, and the messages in them. test/peers/mcap_test.py reads them with
// MCAP's own library.
#include "io/exporters/export_fixture.hpp"
#include "io/exporters/export_mcap.hpp"
#include "io/readers/bag.hpp"
#include "octosurf_foxglove.pb.h"

namespace octosurf::test {
namespace {

using ::testing::Pair;

struct Message {
  std::string topic;
  std::uint64_t time_ns = 0;
  std::string bytes;
  bool operator==(const Message&) const = default;
};

class McapExport : public ExportTest {
 protected:
  template <class Fill>
  std::vector<Message> written(const Fill& fill) const {
    std::ofstream out(path("log.mcap"), std::ios::binary);
    fill(out);
    out.close();
    return read();
  }
  std::vector<Message> read() const {
    const auto bag = io::open_mcap(path("log.mcap"));
    std::vector<Message> all;
    std::vector<io::MessagePlace> places;
    bag->read_all(
        [&](const io::BagMessage& message) {
          all.push_back({bag->topics()[message.topic].name, static_cast<std::uint64_t>(message.logged_ns),
                         std::string(message.bytes)});
          places.push_back(message.place);
        },
        nullptr);
    for (std::size_t i = all.size(); i-- > 0;) EXPECT_EQ(bag->read(places[i]), all[i].bytes);
    return all;
  }
  /// Of the messages on a topic.
  template <class Proto>
  static std::vector<Proto> parsed(const std::vector<Message>& messages, const std::string& topic) {
    std::vector<Proto> all;
    for (const Message& message : messages)
      if (message.topic == topic) {
        EXPECT_TRUE(all.emplace_back().ParseFromString(message.bytes));
      }
    return all;
  }
};

TEST_F(McapExport, MessagesComeBackAsTheyWereWritten) {
  EXPECT_TRUE(written([](std::ostream& out) { io::write_mcap(out, {}, ""); }).empty());
  std::mt19937_64 random = rng();
  std::vector<Message> wanted;
  for (int i = 0; i < 60; ++i) {
    // Some do not compress.
    std::string bytes(random() % (i % 10 == 0 ? 3'000'000 : 300'000), static_cast<char>(i));
    if (i % 2 == 0)
      for (char& byte : bytes) byte = static_cast<char>(random());
    wanted.push_back({i % 3 == 0 ? "/a" : "/b", random() % 1'000'000'000'000, bytes});
  }
  const std::vector<Message> found = written([&](std::ostream& out) {
    std::vector<io::McapMessage> messages;
    for (const Message& message : wanted)
      messages.push_back({message.topic, "some.Type", message.time_ns, message.bytes});
    io::write_mcap(out, messages, "");
  });
  EXPECT_TRUE(found == wanted);
  std::fstream(path("log.mcap"), std::ios::in | std::ios::out | std::ios::binary)
      .seekp(2'000'000)
      .put(0)
      .put(1);
  EXPECT_THROW(read(), Error) << "check sums see what is changed later";
}

TEST_F(McapExport, ASurfaceIsItsTrianglesWithoutItsHoles) {
  const auto messages = written([&](std::ostream& out) {
    io::write_foxglove(out, room_, Eigen::Vector3d::UnitZ(), {{7.25, Eigen::Isometry3d::Identity()}});
  });
  ASSERT_EQ(messages.size(), 3U) << "a pose twice";
  EXPECT_EQ(messages[0].time_ns, 7'250'000'000U);
  const auto update = parsed<foxglove::SceneUpdate>(messages, "/surfaces").at(0);
  ASSERT_EQ(update.entities_size(), static_cast<int>(room_.surfaces.size() + room_.cylinders.size()));
  for (int i = 0; i < update.entities_size() - 1; ++i) {
    const Surface& surface = *room_.surfaces[static_cast<std::size_t>(i)];
    const foxglove::SceneEntity& entity = update.entities(i);
    EXPECT_EQ(entity.id(), "surface_" + std::to_string(surface.id));
    EXPECT_EQ(entity.frame_id(), "map");
    const foxglove::TriangleListPrimitive& list = entity.triangles(0);
    EXPECT_EQ(list.pose().orientation().w(), 1);
    EXPECT_EQ(static_cast<float>(list.color().g()), surface.color[1]);
    EXPECT_EQ(list.color().a(), 1);
    Mesh mesh;
    for (const auto& point : list.points()) mesh.vertices.emplace_back(point.x(), point.y(), point.z());
    for (int k = 0; k < list.indices_size(); k += 3)
      mesh.triangles.push_back({list.indices(k), list.indices(k + 1), list.indices(k + 2)});
    EXPECT_NEAR(area(mesh), surface.area_m2, 1e-9) << entity.id();
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      EXPECT_NEAR(surface.plane.signed_distance(vertex), 0, 1e-9);
  }
  std::map<std::string, std::string> wall;
  for (const auto& pair : update.entities(2).metadata()) wall[pair.key()] = pair.value();
  EXPECT_THAT(wall, ElementsAre(Pair("area_m2", "15"), Pair("inliers", "800"), Pair("rms_m", "0.008"),
                                Pair("slope_deg", "90")));
  const foxglove::CylinderPrimitive& pillar = update.entities(update.entities_size() - 1).cylinders(0);
  EXPECT_EQ(pillar.size().x(), 0.25);
  EXPECT_EQ(pillar.size().z(), 2.5);
  EXPECT_EQ(pillar.pose().position().z(), 1.25);
}

TEST_F(McapExport, TimeNeverGoesBack) {
  std::vector<io::StampedPose> poses;
  for (const double stamp_s : {-3.0, 5.0, 4.9, 5.1})
    poses.emplace_back(stamp_s, Eigen::Isometry3d::Identity());
  const std::vector<Message> messages =
      written([&](std::ostream& out) { io::write_foxglove(out, {}, Eigen::Vector3d::UnitZ(), poses); });
  std::vector<std::uint64_t> times;
  for (const Message& message : messages)
    if (message.topic == "/tf") times.push_back(message.time_ns);
  EXPECT_THAT(times, ElementsAre(0U, 5'000'000'000U, 5'000'000'000U, 5'100'000'000U));
  EXPECT_EQ(parsed<foxglove::FrameTransform>(messages, "/tf").at(3).timestamp().nanos(), 100'000'000);
}

}  // namespace
}  // namespace octosurf::test
