// Every byte of the corpora flipped, and every beginning of them: an Error or a sound result, within the
// bound of memory; where a file says how long it is or has a checksum, the Error or what the undamaged file
// holds.
#include "fuzz/corpus.hpp"
#include "fuzz/input_file.hpp"
#include "io/map_file/map_file.hpp"
#include "map_file.pb.h"
#include "occupancy/occupancy_map.hpp"
#include "support/packed_map.hpp"

#include <gmock/gmock.h>
#include <sstream>

#include <octosurf/map.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf::fuzz {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string surfaces_in(const std::string& bytes) {
  std::istringstream in(bytes);
  const io::MapFile file = io::read_map(in, bytes.size(), "input");
  std::ostringstream out;
  io::write_map(*file.state, file.bt, out, file.scans);
  return out.str();
}

std::string nodes_in(const fs::path& file) {
  std::string nodes;
  occupancy::OccupancyMap::read_octomap(file, {}).write_nodes(
      [&](const std::string& chunk) { nodes += chunk; });
  return nodes;
}

std::string scans_in(const fs::path& file) {
  std::string all;
  const auto scans = open_scans({file}, {});
  while (const std::optional<Scan> scan = scans->next()) {
    const Eigen::Matrix4d T = scan->T_map_sensor.matrix();
    all.append(reinterpret_cast<const char*>(T.data()), sizeof T);
    all.append(reinterpret_cast<const char*>(scan->points.data()),
               sizeof(Eigen::Vector3f) * scan->points.size());
  }
  return all;
}

/// Kinds of files that tell their length, and those in which a checksum tells every flipped byte.
constexpr std::string_view tell_length[] = {"surfaces", "octomap", "mcap", "db3", "bag"},
                           tell_all[] = {"surfaces", "mcap"};

template <class Kinds>
bool is_one(const Kinds& kinds, std::string_view name) {
  return std::find(std::begin(kinds), std::end(kinds), name) != std::end(kinds);
}

/// What a file of this kind holds; nothing if it is refused.
std::string held(const Input& input, const std::string& bytes) {
  try {
    if (input.target->name == "surfaces") return surfaces_in(bytes);
    const InputFile file(as_bytes(bytes), input.file.extension());
    return input.target->name == "octomap" ? nodes_in(file.path()) : scans_in(file.path());
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::data) << error.what();
    EXPECT_NE(error.hint(), "") << error.what();
    return {};
  }
}

class EveryByte : public ::testing::TestWithParam<Input> {
 protected:
  const Input& input = GetParam();
  const std::string good = content_of(input.file);
  /// Of large files a share of the bytes, and all of the first.
  std::size_t after(std::size_t at) const { return at + (at < 200 ? 1 : 1 + good.size() / most); }
  static constexpr std::size_t most = 600;
};

TEST_P(EveryByte, Flipped) {
  const bool tells =
      is_one(tell_all, input.target->name) && input.file.stem() != "bare";  // without checksums
  const std::string holds = tells ? held(input, good) : "";
  for (std::size_t at = 0; at < good.size(); at = after(at)) {
    SCOPED_TRACE(at);
    std::string damaged = good;
    damaged[at] = static_cast<char>(damaged[at] ^ (at % 2 == 0 ? 0xff : 1 << at / 2 % 8));
    expect_read_or_refused(input.target->run, damaged);
    if (holds.empty()) continue;
    const std::string now = held(input, damaged);
    ASSERT_TRUE(now.empty() || now == holds) << "byte " << at;
  }
}

TEST_P(EveryByte, Truncated) {
  const bool tells = is_one(tell_length, input.target->name);
  const std::string holds = tells ? held(input, good) : "";
  for (std::size_t n = 0; n < good.size(); n = after(n)) {
    SCOPED_TRACE(n);
    const std::string beginning = good.substr(0, n);
    expect_read_or_refused(input.target->run, beginning);
    if (!tells) continue;
    const std::string now = held(input, beginning);
    ASSERT_TRUE(now.empty() || now == holds) << n << " of " << good.size() << " bytes";
  }
}

INSTANTIATE_TEST_SUITE_P(Corpus, EveryByte, ::testing::ValuesIn(inputs("corpus")), name_of);

/// The .bt has no checksum of its own: what is damaged in it may be another octree. Beside its .surfaces it
/// changes nothing and is named.
TEST(DamagedMap, ABtBesideItsSurfacesIsNamed) {
  const std::string bt = content_of(corpus() / "octomap/two_planes.bt");
  const InputFolder folder;
  const fs::path stem = folder.path() / "map";
  fs::copy_file(corpus() / "surfaces/two_planes.surfaces", stem.string() + ".surfaces");
  const auto warning = [&](const std::string& damaged) {
    folder.add("map.bt", as_bytes(damaged));
    const LoadedMap loaded = load_map(stem);
    EXPECT_EQ(loaded.map.size().points, 998U);
    return loaded.warning;
  };
  EXPECT_EQ(warning(bt), "");
  for (std::size_t i = 0; i < bt.size(); i += 16) {
    std::string damaged = bt;
    damaged[i] = static_cast<char>(damaged[i] ^ 0xff);
    EXPECT_THAT(warning(damaged), HasSubstr("is not the one"));
    EXPECT_THAT(warning(bt.substr(0, i)), HasSubstr("is not the one"));
  }
}

/// An octree of points far from one another: eight bytes of the stream for a brick of 280 in memory, and the
/// stream a thousandth of that in the file.
TEST(DamagedMap, AnOctreeThatZstdShrankToNothingIsRefused) {
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
  std::vector<std::string> bomb{
      test::records_of(content_of(corpus() / "surfaces/two_planes.surfaces")).front()};
  for (std::size_t i = 0; i < octree.size(); i += 1 << 20) {
    map_file::Record record;
    record.set_octree(octree.substr(i, 1 << 20));
    bomb.push_back(record.SerializeAsString());
  }
  const std::string file = test::map_file_of(bomb);
  EXPECT_LT(file.size(), 30000U);
  EXPECT_GT(octree.size(), 16000000U);
  expect_read_or_refused(fuzz_surfaces, file);
  try {
    surfaces_in(file);
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::AnyOf(HasSubstr("far more memory than its size allows"),
                                               HasSubstr("decompresses to far more"),
                                               HasSubstr("far more memory than the file")));
  }
}

}  // namespace
}  // namespace octosurf::fuzz
