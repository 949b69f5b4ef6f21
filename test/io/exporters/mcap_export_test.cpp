// MCAP files as our own reader finds them, and the messages in them. test/web/mcap_test.mjs reads them with
// MCAP's own library.
#include "io/exporters/export_fixture.hpp"
#include "io/exporters/foxglove_log.hpp"
#include "io/exporters/mcap_writer.hpp"
#include "io/readers/bag.hpp"
#include "octosurf_foxglove.pb.h"

namespace octosurf::test {
namespace {

using ::testing::ElementsAre;
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
  template <class Add>
  std::vector<Message> logged(const Add& add) const {
    return written([&](std::ostream& out) {
      io::FoxgloveLog log(out, Eigen::Vector3d::UnitZ());
      add(log);
      log.finish();
    });
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
  EXPECT_TRUE(written([](std::ostream& out) { io::McapWriter(out).finish(); }).empty());
  std::mt19937_64 random = rng();
  std::vector<Message> wanted;
  for (int i = 0; i < 60; ++i) {
    // Some larger than a chunk, some that do not compress.
    std::string bytes(random() % (i % 10 == 0 ? 3'000'000 : 300'000), static_cast<char>(i));
    if (i % 2 == 0)
      for (char& byte : bytes) byte = static_cast<char>(random());
    wanted.push_back({i % 3 == 0 ? "/a" : "/b", random() % 1'000'000'000'000, bytes});
  }
  const std::vector<Message> found = written([&](std::ostream& out) {
    io::McapWriter file(out);
    std::map<std::string, std::uint16_t> channels;
    for (const Message& message : wanted) {
      if (!channels.contains(message.topic))
        channels[message.topic] = file.add_channel(message.topic, "some.Type", "");
      file.write(channels[message.topic], message.time_ns, message.bytes);
    }
    file.finish();
  });
  EXPECT_TRUE(found == wanted);
  std::fstream(path("log.mcap"), std::ios::in | std::ios::out | std::ios::binary)
      .seekp(2'000'000)
      .put(0)
      .put(1);
  EXPECT_THROW(read(), Error) << "check sums see what is changed later";
}

TEST_F(McapExport, ASurfaceIsItsTrianglesWithoutItsHoles) {
  const auto messages = logged([&](io::FoxgloveLog& log) { log.add_surfaces(7.25, room_); });
  ASSERT_EQ(messages.size(), 1U);
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
  const std::vector<Message> messages = logged([](io::FoxgloveLog& log) {
    for (const double stamp_s : {-3.0, 5.0, 4.9, 5.1}) log.add_pose(stamp_s, Eigen::Isometry3d::Identity());
  });
  std::vector<std::uint64_t> times;
  for (const Message& message : messages) times.push_back(message.time_ns);
  EXPECT_THAT(times, ElementsAre(0U, 5'000'000'000U, 5'000'000'000U, 5'100'000'000U));
  EXPECT_EQ(parsed<foxglove::FrameTransform>(messages, "/tf").at(3).timestamp().nanos(), 100'000'000);
}

class McapVoxels : public McapExport {
 protected:
  static constexpr double d = 0.1;
  static constexpr std::uint16_t zero = 32768;  // the key that begins at 0 m

  foxglove::VoxelGrid grid(const std::vector<OccupancyView::Leaf>& leaves) const {
    Parameters parameters;
    parameters.occupancy.resolution = d;
    const Map map = map_from_leaves(leaves, parameters);
    const auto messages =
        logged([&](io::FoxgloveLog& log) { log.add_voxels(1, map.octree(), *map.snapshot()); });
    return parsed<foxglove::VoxelGrid>(messages, "/voxels").at(0);
  }
  static OccupancyView::Leaf leaf(int x, int y, int z, std::uint8_t level, float log_odds) {
    const auto key = [](int i) { return static_cast<std::uint16_t>(zero + i); };
    return {{key(x), key(y), key(z)}, level, log_odds};
  }
  /// Field `offset` of the cell that holds a place, by the formula of Foxglove's schema.
  static int value(const foxglove::VoxelGrid& grid, std::uint32_t offset, const Eigen::Vector3d& place) {
    const auto& corner = grid.pose().position();
    const auto index = [&](double at, double from) {
      return static_cast<std::uint32_t>(std::floor((at - from) / grid.cell_size().x()));
    };
    const std::size_t at = index(place.z(), corner.z()) * grid.slice_stride() +
                           index(place.y(), corner.y()) * grid.row_stride() +
                           index(place.x(), corner.x()) * grid.cell_stride() + offset;
    return static_cast<std::uint8_t>(grid.data().at(at));
  }
};

TEST_F(McapVoxels, CellsSayWhatIsKnownOfTheirPlace) {
  // Occupied at (0, 0, 0) and (3, 2, 1), a free cube of 2³ from (0, 0, 0) on but for the former, free far
  // away.
  std::vector<OccupancyView::Leaf> leaves{leaf(0, 0, 0, 1, -1), leaf(0, 0, 0, 0, 1), leaf(3, 2, 1, 0, 1),
                                          leaf(40, 0, 0, 0, -1)};
  const foxglove::VoxelGrid found = grid(leaves);
  EXPECT_EQ(found.column_count(), 4U);
  EXPECT_EQ(found.row_count(), 3U);
  EXPECT_EQ(found.data().size(), std::size_t{2} * found.slice_stride());
  EXPECT_NEAR(found.cell_size().z(), d, 1e-12);
  ASSERT_EQ(found.fields(4).name(), "occupancy");
  ASSERT_EQ(found.fields(3).name(), "alpha");
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 2; ++z) {
        const bool occupied = (x == 0 && y == 0 && z == 0) || (x == 3 && y == 2 && z == 1);
        const bool free = x < 2 && y < 2 && !occupied;
        const Eigen::Vector3d place = d * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        EXPECT_EQ(value(found, found.fields(4).offset(), place), occupied ? 2 : free ? 1 : 0) << place;
        EXPECT_EQ(value(found, found.fields(3).offset(), place), occupied ? 255 : 0);
      }
}

TEST_F(McapVoxels, ALargeBoxHasLargeCells) {
  // 1000 voxels to an edge; 250 cells of 4 are too many, 125 of 8 are not.
  const foxglove::VoxelGrid found =
      grid({leaf(0, 0, 0, 0, 1), leaf(999, 999, 999, 0, 1), leaf(8, 0, 0, 3, -1)});
  EXPECT_NEAR(found.cell_size().x(), 8 * d, 1e-12);
  EXPECT_EQ(found.column_count(), 125U);
  EXPECT_EQ(found.data().size(), std::size_t{125} * found.slice_stride());
  const std::uint32_t occupancy = found.fields(4).offset();
  EXPECT_EQ(value(found, occupancy, {0.75, 0.75, 0.75}), 2) << "occupied somewhere";
  EXPECT_EQ(value(found, occupancy, {0.85, 0.05, 0.05}), 1);
  EXPECT_EQ(value(found, occupancy, {0.05, 0.85, 0.05}), 0);
  EXPECT_EQ(value(found, occupancy, {99.95, 99.95, 99.95}), 2);
}

}  // namespace
}  // namespace octosurf::test
