// One small map's two files, damaged everywhere: the same map or an Error, and memory within the bound.
#include "fuzz/input_file.hpp"
#include "fuzz/peak_memory.hpp"
#include "io/map_file/map_file.hpp"
#include "map_file.pb.h"
#include "occupancy/occupancy_map.hpp"
#include "support/packed_map.hpp"
#include "support/paths.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <iterator>
#include <sstream>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::fuzz {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
fs::path corpus() { return fs::path(test::paths::source()) / "test/fuzz/corpus"; }

/// What comes of a map file: what it is when saved again, or what its Error says.
std::string outcome_of(const std::string& bytes) {
  reading_peak = 0;
  try {
    io::MapFile file;
    {
      const PeakMemory peak(reading_peak);
      std::istringstream in(bytes);
      file = io::read_map(in, bytes.size(), "input");
    }
    EXPECT_LE(reading_peak, free_bytes + bytes_per_file_byte * bytes.size());
    std::ostringstream out;
    io::write_map(*file.state, file.bt, out);
    return out.str();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::data);
    EXPECT_LE(reading_peak, free_bytes + bytes_per_file_byte * bytes.size());
    return error.what();
  }
}

class DamagedMap : public ::testing::Test {
 protected:
  void SetUp() override {
    surfaces = content_of(corpus() / "surfaces/two_planes.surfaces");
    bt = content_of(corpus() / "octomap/two_planes.bt");
    good = outcome_of(surfaces);
    ASSERT_EQ(good.substr(0, 8), io::map_file_magic) << good;
  }
  /// The same map, or an Error.
  void expect_the_same_or_refused(const std::string& damaged, std::size_t at) {
    const std::string outcome = outcome_of(damaged);
    if (outcome.starts_with("input: ")) return;
    ASSERT_TRUE(outcome == good) << "another map, from byte " << at << " on";
  }
  std::string surfaces, bt, good;
};

TEST_F(DamagedMap, EveryByteOfTheSurfacesFlipped) {
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    for (const int mask : {0xff, 1 << i % 8}) {
      std::string damaged = surfaces;
      damaged[i] = static_cast<char>(damaged[i] ^ mask);
      expect_the_same_or_refused(damaged, i);
    }
}

TEST_F(DamagedMap, EveryTruncationOfTheSurfaces) {
  for (std::size_t n = 0; n < surfaces.size(); ++n)
    ASSERT_TRUE(outcome_of(surfaces.substr(0, n)).starts_with("input: ")) << n << " bytes";
}

/// The .bt has no checksum of its own: what is damaged in it may be another octree. Beside its .surfaces it
/// changes nothing and is named.
TEST_F(DamagedMap, EveryByteOfTheBtFlippedAndEveryTruncation) {
  const auto read_alone = [&](const std::string& damaged) {
    const InputFile file({reinterpret_cast<const std::uint8_t*>(damaged.data()), damaged.size()}, ".bt");
    reading_peak = 0;
    accepted([&] {
      occupancy::OccupancyMap map = occupancy::OccupancyMap::read_octomap(file.path(), {});
      return map.adopt_occupied_voxels().size();
    });
    EXPECT_LE(reading_peak, free_bytes + bytes_per_file_byte * damaged.size());
  };
  const fs::path stem = fs::temp_directory_path() / ("octosurf-damaged-" + std::to_string(getpid()));
  const fs::path bt_file = stem.string() + ".bt", surfaces_file = stem.string() + ".surfaces";
  save_map(load_map(corpus() / "surfaces/two_planes").map, stem);
  const std::string own = content_of(bt_file);
  ASSERT_TRUE(own == bt);
  const auto read_beside = [&](const std::string& damaged) {
    std::ofstream(bt_file, std::ios::binary) << damaged;
    const LoadedMap loaded = load_map(stem);
    EXPECT_THAT(loaded.warning, ::testing::HasSubstr("is not the one"));
    EXPECT_EQ(loaded.map.size().points, 998U);
  };
  for (std::size_t i = 0; i < bt.size(); ++i) {
    std::string damaged = bt;
    damaged[i] = static_cast<char>(damaged[i] ^ 0xff);
    read_alone(damaged);
    read_alone(bt.substr(0, i));
    if (i % 16 != 0) continue;
    read_beside(damaged);
    read_beside(bt.substr(0, i));
  }
  fs::remove(bt_file);
  fs::remove(surfaces_file);
}

/// An octree of points far from one another: eight bytes of the stream for a brick of 280 in memory, and the
/// stream a thousandth of that in the file.
TEST_F(DamagedMap, AnOctreeThatZstdShrankToNothingIsRefused) {
  std::string lone;  // one free voxel in a cube of 4³
  for (int level = 0; level < 2; ++level) lone += '\x01';
  lone += std::string("\0\0\0\0\xbf\0", 6);
  std::string cube = lone;
  for (int level = 2; level < 9; ++level) {
    std::string eight = "\xff";
    for (int child = 0; child < 8; ++child) eight += cube;
    cube = std::move(eight);
  }
  std::string octree(16 - 9, '\x01');
  octree += cube;
  std::vector<std::string> records = test::records_of(surfaces);
  std::vector<std::string> bomb{records.front()};
  for (std::size_t i = 0; i < octree.size(); i += 1 << 20) {
    map_file::Record record;
    record.set_octree(octree.substr(i, 1 << 20));
    bomb.push_back(record.SerializeAsString());
  }
  const std::string file = test::map_file_of(bomb);
  EXPECT_LT(file.size(), 30000U);
  EXPECT_GT(octree.size(), 16000000U);
  EXPECT_THAT(outcome_of(file), ::testing::AnyOf(::testing::HasSubstr("far more memory than its size allows"),
                                                 ::testing::HasSubstr("decompresses to far more"),
                                                 ::testing::HasSubstr("far more memory than the file")));
}

}  // namespace
}  // namespace octosurf::fuzz
