// Runs that cannot go on: one line, the last complete checkpoint, nothing good written over.
#include "apps/command.hpp"
#include "apps/running.hpp"
#include "support/invariants.hpp"
#include "support/sanitized.hpp"
#include "support/seed.hpp"
#include "surfaces/map_state.hpp"

#include <gmock/gmock.h>
#include <random>

#include <octosurf/map.hpp>

namespace octosurf::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FailingRun : public CommandTest {
 protected:
  bool same(const std::string& a, const std::string& b) const {
    return read(a + ".surfaces") == read(b + ".surfaces") && read(a + ".bt") == read(b + ".bt");
  }
  /// How many scans the last line says are saved: in a checkpoint, or because all could be saved in the end;
  /// -1: none.
  static int scans_told(const std::string& line) {
    std::size_t end = line.find(" scans of this run");
    if (end == std::string::npos) end = line.find(" scans mapped and saved");
    if (end == std::string::npos) return -1;
    return std::stoi(line.substr(line.rfind(' ', end - 1) + 1));
  }
};

TEST_F(FailingRun, ACheckpointThatFailsIsToldOnceAndTheRunGoesOn) {
  write_floor("floor", 400);
  Running run(folder, {"map", "floor", "-o", "m", "--realtime", "--rate", "20", "--checkpoint", "0.02"});
  ASSERT_TRUE(run.wait_until([&] { return exists("m.surfaces"); })) << run.errors();
  // A folder in its place cannot be replaced; the file may come back before it is made.
  std::error_code taken;
  do {
    fs::rename(folder / "m.surfaces", folder / "kept.surfaces", taken);
  } while (!fs::create_directory(folder / "m.surfaces", taken) || taken);
  const auto warned = [&] { return run.errors().find("warning: no checkpoint") != std::string::npos; };
  ASSERT_TRUE(run.wait_until(warned)) << run.errors();
  std::this_thread::sleep_for(std::chrono::milliseconds(150));  // some more of them fail
  fs::remove(folder / "m.surfaces");
  ASSERT_TRUE(run.wait_until([&] { return fs::is_regular_file(folder / "m.surfaces"); })) << run.errors();
  run.send(SIGTERM);
  EXPECT_EQ(run.wait(), 1);
  const std::string errors = run.errors();
  EXPECT_EQ(errors.find("warning: no checkpoint"), errors.rfind("warning: no checkpoint")) << errors;
  EXPECT_THAT(errors, AllOf(HasSubstr("m.surfaces: "), HasSubstr("the last complete checkpoint is m "),
                            HasSubstr("the run goes on"), HasSubstr("mapped and saved")));
  EXPECT_THAT(check_invariants(load_map(folder / "m").map), IsEmpty());
}

TEST_F(FailingRun, AFullDiskNamesTheLastCheckpoint) {
  write_floor("floor", 30);
  run_well("map floor -o whole");
  run_well("map floor -o some --first 6");
  // Files may not become larger than a map of six scans and a bit: in blocks of 512 bytes.
  const auto blocks = fs::file_size(folder / "some.surfaces") / 512 + 4;
  ASSERT_LT(blocks * 512, fs::file_size(folder / "whole.surfaces"));
  const Outcome outcome = run("map floor -o m --checkpoint 0.000001 --report r.json",
                              "ulimit -f " + std::to_string(blocks) + ";");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  ASSERT_GE(outcome.errors.size(), 2u) << outcome.err;  // a scan may make the file smaller again
  for (std::size_t i = 0; i + 1 < outcome.errors.size(); ++i)
    EXPECT_THAT(outcome.errors[i], AllOf(HasSubstr("warning: no checkpoint"), HasSubstr("File too large"),
                                         HasSubstr("the last complete checkpoint is m with ")));
  const std::string& line = outcome.errors.back();
  EXPECT_THAT(line,
              AllOf(HasSubstr("octosurf map: m.surfaces: cannot be written: File too large"),
                    HasSubstr("the last complete checkpoint is m with "), HasSubstr("--resume m goes on")));
  const int scans = scans_told(line);
  EXPECT_GE(scans, 6);
  EXPECT_EQ(info("m").at("scans"), scans);
  EXPECT_FALSE(exists("r.json"));
  // And with nothing saved before it, nothing is there. Of few scans: stderr may not become larger, either.
  const Outcome none = run("map floor -o n --first 2", "ulimit -f 1;");
  EXPECT_EQ(none.code, 1);
  ASSERT_EQ(none.errors.size(), 1u) << none.err;
  EXPECT_THAT(none.errors[0], HasSubstr("no checkpoint of this run was complete"));
  EXPECT_FALSE(exists("n.surfaces") || exists("n.bt"));
}

TEST_F(FailingRun, TooFewFilesNameTheirLimit) {
  write_floor("floor", 2);
  for (const char* limit : {"ulimit -n 5;", "ulimit -n 6;"}) {  // at reading back, and at the folder's sync
    const Outcome none = run("map floor -o n", limit);
    EXPECT_EQ(none.code, 1);
    EXPECT_THAT(none.err, AllOf(HasSubstr("n."), HasSubstr("(ulimit -n)"), Not(HasSubstr("disk;"))));
  }
}

TEST_F(FailingRun, NoMemoryKeepsWhatWasMapped) {
  if (sanitized) GTEST_SKIP() << "a sanitizer needs more address space than any limit leaves";
  constexpr int images = 160;
  write_floor("floor", images);
  // A new place for each image, and noise: a file of equal floors shrinks so far that it is taken for a bomb.
  std::string poses;
  std::mt19937_64 noise = rng();
  for (int i = 0; i < images; ++i) {
    poses += std::to_string(3 * (i % 20)) + " " + std::to_string(3 * (i / 20)) + " 1 1 0 0 0\n";
    std::string image = "P5\n80 60\n65535\n";
    for (int k = 0; k < floor_points; ++k) {
      const auto depth_mm = static_cast<unsigned>(998 + noise() % 5);
      image += {static_cast<char>(depth_mm >> 8), static_cast<char>(depth_mm & 0xff)};
    }
    write("floor/" + std::to_string(i) + ".pgm", image);
  }
  write("floor/poses.txt", poses);
  int named = 0;
  for (int limit_mb = 200; limit_mb <= 440 && named == 0; limit_mb += 40) {
    for (const char* file : {"m.surfaces", "m.bt"}) fs::remove(folder / file);
    const Outcome outcome =
        run("map floor -o m --checkpoint 0.05", "ulimit -v " + std::to_string(1024 * limit_mb) + ";");
    SCOPED_TRACE(std::to_string(limit_mb) + " MB: " + outcome.err);
    if (outcome.code == 0 || outcome.code == 127) continue;  // enough, or too little to be loaded
    EXPECT_EQ(outcome.code, 1);
    ASSERT_FALSE(outcome.errors.empty());
    const std::string& line = outcome.errors.back();
    EXPECT_THAT(outcome.errors.size() - 1,
                static_cast<std::size_t>(std::count_if(
                    outcome.errors.begin(), outcome.errors.end(),
                    [](const std::string& text) { return text.starts_with("warning: no checkpoint"); })));
    EXPECT_THAT(line, AnyOf(HasSubstr("memory"), HasSubstr("shared libraries")));
    const int scans = scans_told(line);
    if (scans < 0) continue;
    ++named;
    EXPECT_EQ(info("m").at("scans"), scans);
  }
  EXPECT_GT(named, 0) << "no limit let it map some and then run out of memory";
}

TEST_F(FailingRun, IdsThatAreUsedUpLeaveTheMapAsItWas) {
  write_floor("floor", 6);
  run_well("map floor -o m --first 2");
  {
    LoadedMap loaded = load_map(folder / "m");
    surfaces::state_of(loaded.map).surfaces.set_next_id(0xffffff);
    save_map(loaded.map, folder / "m");
    save_map(loaded.map, folder / "kept");
  }
  EXPECT_THAT(error_of("map floor --resume m --skip 2", 1), HasSubstr("ids of surfaces could run out"));
  EXPECT_TRUE(same("m", "kept"));
  EXPECT_THAT(run_well("map floor --resume m --skip 2 --skip-bad").out, HasSubstr("4 skipped"));
  EXPECT_TRUE(same("m", "kept"));
  EXPECT_THAT(check_invariants(load_map(folder / "m").map), IsEmpty());
}

TEST_F(FailingRun, OutputsAreNotTheMapItself) {
  write_floor("floor", 2);
  fs::create_directory_symlink(folder, folder / "here");
  const auto refused = [&](const std::string& report, const std::string& more = {}) {
    EXPECT_THAT(error_of("map floor -o m --report '" + report + "' " + more, 2), HasSubstr("--report"))
        << report;
  };
  for (const char* report : {"m.surfaces", "m.bt", "./m.bt", "floor/../m.surfaces", "here/m.bt"})
    refused(report);
  refused((folder / "m.surfaces").string());
  EXPECT_FALSE(exists("m.surfaces") || exists("m.bt")) << "refused before any work is done";

  run_well("map floor -o m");
  run_well("map floor -o kept");
  run_well("map floor -o other");
  fs::create_hard_link(folder / "m.surfaces", folder / "hard.json");
  fs::create_symlink("m.bt", folder / "soft.json");
  for (const char* report : {"m.surfaces", "m.bt", "hard.json", "soft.json"}) refused(report, "--force");
  refused("other.surfaces", "--force --resume other");
  EXPECT_TRUE(same("m", "kept") && same("other", "kept"));

  write("truth.json", "{}");
  for (const char* json : {"m.surfaces", "hard.json", "truth.json"})
    EXPECT_THAT(error_of(std::string("evaluate m --truth truth.json --force --json ") + json, 2),
                HasSubstr("--json"))
        << json;
  EXPECT_THAT(error_of("view m --force --png m.bt", 2), HasSubstr("--png"));
  EXPECT_TRUE(same("m", "kept"));
  EXPECT_EQ(read("truth.json"), "{}");
}

TEST_F(FailingRun, OutputsAreNotInputs) {
  write_floor("floor", 2);
  run_well("map floor -o old");
  fs::copy_file(folder / "floor/poses.txt", folder / "poses.txt");
  fs::copy_file(folder / "floor/intrinsics.txt", folder / "K.txt");
  write("c.txt", "resolution = 0.02\n");
  const auto refused = [&](const std::string& file, const std::string& arguments) {
    const std::string before = read(file);
    EXPECT_THAT(error_of("map " + arguments + " --force", 2), HasSubstr(file));
    EXPECT_EQ(read(file), before);
  };
  refused("floor/poses.txt", "floor -o m --report floor/poses.txt");
  refused("floor/1.pgm", "floor -o m --report ./floor/1.pgm");
  refused("poses.txt", "floor -o m --poses poses.txt --report poses.txt");
  refused("K.txt", "floor -o m --intrinsics K.txt --report K.txt");
  refused("c.txt", "floor -o m --config c.txt --report c.txt");
  refused("old.bt", "old.bt -o m --report old.bt");
  refused("old.bt", "old.bt -o old");
  EXPECT_FALSE(exists("m.surfaces"));
  run_well("map floor -o m --report floor/new.json");  // a file of its own may stand there
}

}  // namespace
}  // namespace octosurf::test
