#pragma once

#include "io/files.hpp"
#include "simulation/simulate.hpp"

namespace octosurf::simulation {

using octosurf::test::read_file;

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

class FolderTest : public octosurf::test::FolderTest {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    octosurf::test::write_file(path(name), bytes);
    return path(name);
  }
  const std::filesystem::path& dir_ = folder;
};

}  // namespace octosurf::simulation
