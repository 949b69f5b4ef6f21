// Power cuts: whenever the command is killed, the last complete checkpoint loads, is sound and is gone on
// with.
#include "apps/command.hpp"
#include "apps/running.hpp"
#include "support/invariants.hpp"
#include "support/seed.hpp"

#include <chrono>
#include <cstdlib>
#include <gmock/gmock.h>
#include <random>
#include <thread>

#include <octosurf/map.hpp>
#include <octosurf/mapper.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using std::chrono::microseconds;
using ::testing::IsEmpty;

/// How many kills: OCTOSURF_KILLS, else few, so that the suite stays fast.
int kills() {
  const char* given = std::getenv("OCTOSURF_KILLS");
  return given != nullptr ? std::stoi(given) : 12;
}

class Killed : public CommandTest {
 protected:
  static constexpr int images = 14, seeded = 3;

  Killed() {
    write_floor("floor", images);
    run_well("map floor -o whole");
    run_well("map floor -o seed --first " + std::to_string(seeded));
  }

  void begin_anew() const {
    for (const fs::path& part : parts()) fs::remove(part);
    for (const char* ending : {".surfaces", ".bt"})
      fs::copy_file(folder / (std::string("seed") + ending), folder / (std::string("m") + ending),
                    fs::copy_options::overwrite_existing);
  }
  /// Goes on with the seed and saves after every scan, which takes longer than the scan: most kills are
  /// inside.
  static std::vector<std::string> going_on() {
    return {"map",          "floor",    "--resume",  "m", "--skip", std::to_string(seeded),
            "--checkpoint", "0.000001", "--threads", "1"};
  }
  std::vector<fs::path> parts() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().filename().string().find(".part-") != std::string::npos) found.push_back(entry.path());
    }
    return found;
  }

  /// What is there loads, is sound, and ends like a run that nobody killed.
  void expect_to_go_on() const {
    std::size_t scans = 0;
    {
      const LoadedMap loaded = load_map(folder / "m");
      EXPECT_THAT(check_invariants(loaded.map), IsEmpty());
      scans = loaded.map.size().scans;
    }
    EXPECT_GE(scans, static_cast<std::size_t>(seeded));
    if (scans < images)  // --skip would leave none
      run_well("map floor --resume m --skip " + std::to_string(scans));
    else
      save_map(load_map(folder / "m").map, folder / "m");  // in case its .bt is of an earlier one
    EXPECT_TRUE(read("m.surfaces") == read("whole.surfaces")) << "killed after " << scans << " scans";
    EXPECT_TRUE(read("m.bt") == read("whole.bt")) << "killed after " << scans << " scans";
    EXPECT_THAT(parts(), IsEmpty()) << "what the killed run has left";
  }
};

TEST_F(Killed, AtAnyMomentItsLastCheckpointGoesOn) {
  std::mt19937_64 rng(seed());
  begin_anew();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(Running(folder, going_on()).wait(), 0);
  const auto whole = std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now() - start);
  int killed = 0, advanced = 0, inside = 0;
  for (const int wanted = kills(); killed < wanted && !HasFailure();) {
    begin_anew();
    Running run(folder, going_on());
    std::this_thread::sleep_for(
        microseconds(std::uniform_int_distribution<microseconds::rep>(0, whole.count())(rng)));
    run.send(SIGKILL);
    if (run.wait() != 128 + SIGKILL) continue;  // it was done already
    ++killed;
    inside += !parts().empty();
    advanced += read("m.surfaces") != read("seed.surfaces");
    expect_to_go_on();
  }
  std::cout << killed << " kills, " << advanced << " of them after a checkpoint of its own, " << inside
            << " inside a save\n";
  EXPECT_GT(inside, 0);
  EXPECT_GT(advanced, 0) << "no run has come as far as a checkpoint";
}

}  // namespace
}  // namespace octosurf::test
