// Streams that shrink further than readers believe: they are made longer, and come back.
#include "io/map_file/record_stream.hpp"

#include "support/seed.hpp"

#include <gtest/gtest.h>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr Expansion limits{.free = std::uint64_t{1} << 20, .ratio = 12};
constexpr std::size_t megabyte = std::size_t{1} << 20;

std::string written(const std::vector<std::string>& records) {
  std::ostringstream out;
  RecordWriter writer(out);
  for (const std::string& record : records) writer.put(record);
  writer.finish(limits.least_file(writer.bytes()));
  return out.str();
}

std::vector<std::string> read(const std::string& file) {
  std::istringstream in(file);
  RecordReader reader(in, limits.most(file.size()), "file");
  std::vector<std::string> records;
  for (std::string record; reader.next(record);) records.push_back(record);
  return records;
}

TEST(RecordStream, WhatShrinksFarComesBack) {
  for (const std::size_t count : {1, 2, 20}) {
    const std::vector<std::string> records(count, std::string(megabyte, '\0'));
    const std::string file = written(records);
    EXPECT_EQ(read(file), records);
    EXPECT_LT(file.size(), count * megabyte / 8) << "no longer than needed";
  }
}

TEST(RecordStream, WhatShrinksAsUsualIsNotMadeLonger) {
  std::mt19937_64 rng(test::seed());
  std::string noise(2 * megabyte, '\0');
  for (char& byte : noise) byte = static_cast<char>(rng() & 0xff);
  EXPECT_EQ(read(written({noise})), std::vector{noise});
  EXPECT_LT(written({noise}).size(), noise.size() + 1024);
}

TEST(RecordStream, DamageBehindTheFrameIsSeen) {
  std::mt19937_64 rng(test::seed());
  const std::string file = written({std::string(20 * megabyte, '\0')});
  const std::size_t zeros_from = file.find(std::string(4096, '\0'));
  ASSERT_NE(zeros_from, std::string::npos);
  ASSERT_NO_THROW(read(file));
  EXPECT_THROW(read(file + '\0'), Error);
  for (int round = 0; round < 20; ++round) {
    std::string damaged = file;
    char& byte = damaged[zeros_from - 8 + rng() % (file.size() - zeros_from + 8)];
    byte = static_cast<char>(byte ^ (1 << rng() % 8));
    EXPECT_THROW(read(damaged), Error);
    EXPECT_THROW(read(file.substr(0, zeros_from + rng() % (file.size() - zeros_from))), Error);
  }
}

}  // namespace
}  // namespace octosurf::io
