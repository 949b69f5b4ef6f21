// Replays what libFuzzer starts from and what it found; see targets.hpp.
#include "fuzz/targets.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <iterator>

namespace octosurf::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t free_bytes = std::size_t{64} << 20, bytes_per_file_byte = 8;

struct Input {
  const Target* target;
  fs::path file;
};

/// GoogleTest names tests by it.
std::string name_of(const ::testing::TestParamInfo<Input>& info) {
  std::string name = std::string(info.param.target->name) + "_" + info.param.file.filename().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

/// test/fuzz/`kind`/TARGET/*, in order.
std::vector<Input> inputs(const std::string& kind) {
  std::vector<Input> all;
  for (const Target& target : targets) {
    const fs::path folder = fs::path(OCTOSURF_SOURCE_DIR) / "test/fuzz" / kind / target.name;
    if (!fs::is_directory(folder)) continue;
    for (const auto& entry : fs::directory_iterator(folder)) all.push_back({&target, entry.path()});
  }
  std::sort(all.begin(), all.end(), [](const Input& a, const Input& b) { return a.file < b.file; });
  return all;
}

class Replay : public ::testing::TestWithParam<Input> {};

/// An Error or a sound result, and of memory at most eight times the file and 64 MiB.
TEST_P(Replay, IsReadOrRefused) {
  std::ifstream stream(GetParam().file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  reading_peak = 0;
  GetParam().target->run({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  EXPECT_GT(reading_peak, 0U) << "nothing was measured";
  EXPECT_LE(reading_peak, free_bytes + bytes_per_file_byte * bytes.size());
}

INSTANTIATE_TEST_SUITE_P(Corpus, Replay, ::testing::ValuesIn(inputs("corpus")), name_of);
INSTANTIATE_TEST_SUITE_P(Findings, Replay, ::testing::ValuesIn(inputs("findings")), name_of);

TEST(Fuzz, EveryTargetHasACorpus) {
  for (const Target& target : targets) {
    const fs::path folder = fs::path(OCTOSURF_SOURCE_DIR) / "test/fuzz/corpus" / target.name;
    EXPECT_TRUE(fs::is_directory(folder) && !fs::is_empty(folder)) << target.name;
  }
}

}  // namespace
}  // namespace octosurf::fuzz
