// Replays what libFuzzer starts from and what it found; see targets.hpp.
#include "fuzz/corpus.hpp"
#include "fuzz/input_file.hpp"
#include "fuzz/peak_memory.hpp"
#include "io/readers/cloud_file.hpp"

#include <filesystem>
#include <gmock/gmock.h>
#include <zstd.h>

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

/// Their names are compared with each other.
TEST(Fuzz, AHeaderOfMillionsOfElementsIsSoonRefused) {
  std::string ply = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 1 << 20; ++i) ply += "element e" + std::to_string(i) + " 0\n";
  const InputFile file({reinterpret_cast<const std::uint8_t*>(ply.data()), ply.size()}, ".ply");
  try {
    io::read_ply(file.path());
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("more than 256 elements"));
  }
}

/// An MCAP file of chunks of 12 MB each that pack by far more than bags do, of the same record over and over.
std::string packed_bag(const std::string& record, int chunks) {
  const auto of = [](std::uint8_t op, const std::string& body) {
    const std::uint64_t size = body.size();
    return std::string(1, static_cast<char>(op)) + std::string(reinterpret_cast<const char*>(&size), 8) +
           body;
  };
  const auto text = [](const std::string& value) {
    const auto size = static_cast<std::uint32_t>(value.size());
    return std::string(reinterpret_cast<const char*>(&size), 4) + value;
  };
  const auto channel = [&](char id, const std::string& topic, const std::string& type) {
    const std::string number{id, '\0'};
    return of(3, number + text(type) + text("ros2msg") + text("")) +
           of(4, number + number + text(topic) + text("cdr") + text(""));
  };
  std::string records =
      channel(1, "/tf", "tf2_msgs/msg/TFMessage") + channel(2, "/points", "sensor_msgs/msg/PointCloud2");
  while (records.size() < 12000000) records += of(5, record);
  std::string packed(ZSTD_compressBound(records.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), 3));
  const std::uint64_t sizes[] = {0, 0, records.size(), packed.size()};
  const auto* bytes = reinterpret_cast<const char*>(sizes);
  const std::string chunk = of(
      6, std::string(bytes, 24) + std::string(4, '\0') + text("zstd") + std::string(bytes + 24, 8) + packed);
  std::string bag = "\x89MCAP0\r\n";
  for (int i = 0; i < chunks; ++i) bag += chunk;
  return bag + of(15, std::string(4, '\0'));
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

TEST(Fuzz, AnInputStandsInAFolderAlone) {
  const InputFile one({}, ".pcd"), other({}, ".txt");
  for (const InputFile* input : {&one, &other}) {
    const auto files = fs::directory_iterator(input->path().parent_path());
    EXPECT_EQ(std::distance(files, {}), 1) << input->path();
  }
}

TEST(Fuzz, EveryTargetHasACorpus) {
  for (const Target& target : targets) {
    const fs::path folder = corpus() / target.name;
    EXPECT_TRUE(fs::is_directory(folder) && !fs::is_empty(folder)) << target.name;
  }
}

}  // namespace
}  // namespace octosurf::fuzz
