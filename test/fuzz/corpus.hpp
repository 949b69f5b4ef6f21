#pragma once

#include "fuzz/targets.hpp"
#include "support/paths.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <vector>

// Files that libFuzzer starts from (corpus/TARGET) and that it found (findings/TARGET).
namespace octosurf::fuzz {

struct Input {
  const Target* target;
  std::filesystem::path file;
};

/// GoogleTest names tests by it.
inline std::string name_of(const ::testing::TestParamInfo<Input>& info) {
  std::string name = std::string(info.param.target->name) + "_" + info.param.file.filename().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

inline std::filesystem::path corpus() {
  return std::filesystem::path(test::paths::source()) / "test/fuzz/corpus";
}

/// test/fuzz/`kind`/TARGET/*, in order.
inline std::vector<Input> inputs(const std::string& kind) {
  std::vector<Input> all;
  for (const Target& target : targets) {
    const std::filesystem::path folder = corpus().parent_path() / kind / target.name;
    if (!std::filesystem::is_directory(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      all.push_back({&target, entry.path()});
  }
  std::sort(all.begin(), all.end(), [](const Input& a, const Input& b) { return a.file < b.file; });
  return all;
}

inline std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline Bytes as_bytes(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// An Error or a sound result, and of memory at most eight times the file and 64 MiB.
void expect_read_or_refused(void (*run)(Bytes), const std::string& bytes);

}  // namespace octosurf::fuzz
