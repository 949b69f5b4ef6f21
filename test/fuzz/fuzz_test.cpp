// Replays what libFuzzer starts from and what it found; see targets.hpp.
#include "fuzz/corpus.hpp"
#include "fuzz/input_file.hpp"
#include "io/map_file/map_file.hpp"
#include "io/readers/bag_files.hpp"
#include "io/readers/cloud_file.hpp"
#include "map_file.pb.h"
#include "occupancy/occupancy_map.hpp"
#include "support/packed_map.hpp"

#include <zstd.h>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::fuzz {

void expect_read_or_refused(void (*run)(Bytes), const std::string& bytes) {
  reading_peak = 0;
  run(as_bytes(bytes));
  if (!bytes.empty()) {
    EXPECT_GT(reading_peak, 0U) << "nothing was measured";
  }
  EXPECT_LE(reading_peak, free_bytes + bytes_per_file_byte * bytes.size());
}

namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Replay : public ::testing::TestWithParam<Input> {};

TEST_P(Replay, IsReadOrRefused) {
  expect_read_or_refused(GetParam().target->run, content_of(GetParam().file));
}

INSTANTIATE_TEST_SUITE_P(Corpus, Replay, ::testing::ValuesIn(inputs("corpus")), name_of);
INSTANTIATE_TEST_SUITE_P(Findings, Replay, ::testing::ValuesIn(inputs("findings")), name_of);

/// Their words, taken apart, are far larger than they: twelve times, where a vector doubles.
TEST(Fuzz, LinesOfMillionsOfWordsTakeNoMoreMemoryThanOtherFiles) {
  std::string words;
  for (int i = 0; i < 1 << 24; ++i) words += "1 ";
  const std::string pcd = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n";
  expect_read_or_refused(fuzz_pcd, "# " + words);
  expect_read_or_refused(fuzz_pcd, "FIELDS " + words);
  expect_read_or_refused(fuzz_pcd, pcd + words);
  expect_read_or_refused(fuzz_ply, "ply\ncomment " + words);
  expect_read_or_refused(fuzz_ply, ply + words);
}

/// The message of the Error that `read` throws.
std::string refusal(const std::function<void()>& read) {
  try {
    read();
  } catch (const Error& error) {
    return error.what();
  }
  return "read";
}

/// Their names are compared with each other.
TEST(Fuzz, AHeaderOfMillionsOfElementsIsSoonRefused) {
  std::string ply = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 1 << 20; ++i) ply += "element e" + std::to_string(i) + " 0\n";
  const InputFile file(as_bytes(ply), ".ply");
  EXPECT_THAT(refusal([&] { io::read_ply(file.path()); }), HasSubstr("more than 256 elements"));
}

/// An MCAP file of chunks of 12 MB each that pack by far more than bags do, of the same record over and over.
std::string packed_bag(const std::string& record, int chunks) {
  using test::bytes_of, test::mcap_record;
  const auto text = [](const std::string& value) {
    return bytes_of(static_cast<std::uint32_t>(value.size())) + value;
  };
  std::string records;
  for (const auto& [id, topic, type] : {std::tuple(std::uint16_t{1}, "/tf", "tf2_msgs/msg/TFMessage"),
                                        {std::uint16_t{2}, "/points", "sensor_msgs/msg/PointCloud2"}})
    records += mcap_record(3, bytes_of(id) + text(type) + text("ros2msg") + text("")) +
               mcap_record(4, bytes_of(id, id) + text(topic) + text("cdr") + text(""));
  while (records.size() < 12000000) records += mcap_record(5, record);
  std::string packed(ZSTD_compressBound(records.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), 3));
  const std::string chunk =
      mcap_record(6, bytes_of(std::uint64_t{0}, std::uint64_t{0}, records.size(), std::uint32_t{0}) +
                         text("zstd") + bytes_of(packed.size()) + packed);
  std::string bag = "\x89MCAP0\r\n";
  for (int i = 0; i < chunks; ++i) bag += chunk;
  return bag + mcap_record(15, std::string(4, '\0'));
}

/// 200 times as much is in them as their size says.
TEST(Fuzz, BagsOfManyTransformsAndScansTakeNoMoreMemoryThanOtherFiles) {
  const std::string head = std::string(22, '\0') + std::string("\0\1\0\0", 4);
  std::string transform = head + std::string("\1\0\0\0", 4) + std::string(8, '\0') +
                          std::string("\2\0\0\0m\0\0\0", 8) + std::string("\2\0\0\0l\0\0\0", 8) +
                          std::string(56, '\0');
  transform[0] = 1;
  std::string scan = head + std::string(200, '\0');
  scan[0] = 2;
  expect_read_or_refused(fuzz_mcap, packed_bag(transform, 20));
  expect_read_or_refused(fuzz_mcap, packed_bag(scan, 20));
}

TEST(Fuzz, EveryTargetHasACorpus) {
  for (const Target& target : targets) {
    const fs::path folder = corpus() / target.name;
    EXPECT_TRUE(fs::is_directory(folder) && !fs::is_empty(folder)) << target.name;
  }
}

// ---- every byte ----

// Every byte of the corpora flipped, and every beginning of them: an Error or a sound result, within the
// bound of memory; where a file says how long it is or has a checksum, the Error or what the undamaged file
// holds.

std::string surfaces_in(const std::string& bytes) {
  const test::MapBytes input(bytes);
  const io::MapFile file = io::read_map(input.path());
  return test::map_file_of(*file.state, file.files);
}

std::string nodes_in(const fs::path& file) {
  std::string all;
  occupancy::for_each_part(occupancy::OccupancyMap::read_octomap(file, {}).now(), {},
                           [&](std::uint64_t, const std::string& nodes) { all += nodes; });
  return all;
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

/// An octree of points far from one another: eight bytes of the stream for a brick of 280 in memory, and the
/// stream a thousandth of that in the file.
TEST(DamagedMap, AnOctreeThatZstdShrankToNothingIsRefused) {
  std::string lone;  // one free voxel in a cube of 4³
  for (int level = 0; level < 2; ++level) lone += '\x01';
  lone += std::string("\0\0\0\0\xbf\0", 6);
  std::string cube = lone;
  for (int level = 2; level < occupancy::part_level; ++level) {
    std::string eight = "\xff";
    for (int child = 0; child < 8; ++child) eight += cube;
    cube = std::move(eight);
  }
  std::vector<std::string> bomb{
      test::records_of(content_of(corpus() / "surfaces/two_planes.surfaces")).front()};
  map_file::Record record;
  record.set_octree(cube);
  constexpr std::int64_t first = std::int64_t{1} << 3 * (16 - occupancy::part_level);
  for (int i = 0; i < 400; ++i) {
    record.set_key(first + i);
    bomb.push_back(record.SerializeAsString());
  }
  const std::string file = test::map_file_of(bomb);
  EXPECT_LT(file.size(), 200000U);
  expect_read_or_refused(fuzz_surfaces, file);
  EXPECT_THAT(
      refusal([&] { surfaces_in(file); }),
      ::testing::AnyOf(HasSubstr("far more memory than its size allows"),
                       HasSubstr("decompresses to far more"), HasSubstr("far more memory than the file")));
}

// ---- odd paths ----

struct Reader {
  const char* name;
  std::function<void(const fs::path&)> read;
};

void read_all(const std::vector<fs::path>& inputs, const ScanSourceOptions& options) {
  const auto scans = open_scans(inputs, options);
  while (scans->next()) {
  }
}

const std::vector<Reader>& readers() {
  static const std::vector<Reader> all{
      {"load_map", [](const fs::path& p) { load_map(p); }},
      {"map_from_octomap", [](const fs::path& p) { map_from_octomap(p, {}); }},
      {"read_octomap_resolution", [](const fs::path& p) { read_octomap_resolution(p); }},
      {"is_occupancy_map and open_scans",
       [](const fs::path& p) {
         is_occupancy_map(p);
         read_all({p}, {});
       }},
      {"open_scans", [](const fs::path& p) { read_all({p}, {}); }},
      {"open_scans with poses",
       [](const fs::path& p) {
         ScanSourceOptions options;
         options.poses = p;
         read_all({corpus() / "pcd/ascii.pcd"}, options);
       }},
      {"open_scans with intrinsics", [](const fs::path& p) {
         ScanSourceOptions options;
         options.poses = corpus() / "poses/sixteen.txt";
         options.intrinsics = p;
         read_all({corpus() / "image/filters.png"}, options);
       }}};
  return all;
}

class OddPaths : public ::testing::Test {
 protected:
  static void expect_refused(const fs::path& path) {
    for (const Reader& reader : readers()) {
      SCOPED_TRACE(std::string(reader.name) + " of " + path.string().substr(0, 80));
      try {
        reader.read(path);
        ADD_FAILURE() << "taken";
      } catch (const Error& error) {
        EXPECT_NE(error.kind(), Error::Kind::output);
      }  // anything else fails the test
    }
  }
  const InputFolder made;
  const fs::path folder = made.path();
};

TEST_F(OddPaths, AreRefusedWithAnError) {
  std::ofstream(folder / "file") << "x";
  std::ofstream(folder / "empty");
  fs::create_directory(folder / "folder");
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  fs::create_symlink(folder / "loop", folder / "loop");
  const std::string nul("a\0b", 3);
  for (const fs::path& path :
       {fs::path(), folder / "missing", folder / "empty", folder / "file", folder / "folder",
        folder / "dangling", folder / "loop", folder / "file" / "below", folder / std::string(300, 'n'),
        folder / std::string(9000, 'n'), folder / nul, folder / "\xff\xfe.pcd", fs::path("/dev/null"),
        fs::path("/dev/zero"), fs::path("/proc/self/mem")})
    expect_refused(path);
}

}  // namespace
}  // namespace octosurf::fuzz
