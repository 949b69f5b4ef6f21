#pragma once

#include "simulation/simulate.hpp"
#include "support/seed.hpp"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>
#include <string>

#include <octosurf/error.hpp>

namespace octosurf::simulation {

inline SimulationOptions options_of(const std::string& scene, const std::string& sensor, std::size_t frames,
                                    std::uint64_t seed = octosurf::test::seed()) {
  SimulationOptions options;
  options.scene = scene;
  options.sensor = sensor;
  options.frames = frames;
  options.seed = seed;
  options.length = 8;
  return options;
}

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

/// What `call` is refused with; of this kind, and in one line.
template <class Call>
Error refusal(Error::Kind kind, const Call& call) {
  try {
    call();
    ADD_FAILURE() << "was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error;
  }
  return {kind, "", ""};
}

/// A folder of its own for the running test.
class FolderTest : public testing::Test {
 protected:
  FolderTest() {
    std::filesystem::remove_all(dir_);
    std::filesystem::create_directories(dir_);
  }
  ~FolderTest() override { std::filesystem::remove_all(dir_); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(dir_ / name, std::ios::binary) << bytes;
    return dir_ / name;
  }

  const testing::TestInfo& info_ = *testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path dir_ =
      std::filesystem::path(testing::TempDir()) / "octosurf_lab" / info_.test_suite_name() / info_.name();
};

}  // namespace octosurf::simulation
