// Bad scans, interrupts, kills, full disks and no memory: nothing is lost of what was mapped, and nothing
// good is written over.
#include "apps/command.hpp"
#include "io/kept_scans.hpp"
#include "io/readers/bag.hpp"

#include <chrono>

namespace octosurf::test {
namespace {

class EndsEarly : public CommandTest {
 protected:
  void truncate(const std::string& file) const { write(file, read(file).substr(0, 100)); }
  /// Files whose names begin like this: a temporary one's does with the name of what it becomes.
  std::ptrdiff_t files(const std::string& beginning) const {
    return std::ranges::count_if(fs::directory_iterator(folder), [&](const auto& entry) {
      return entry.path().filename().string().starts_with(beginning);
    });
  }
  void copy_map(const std::string& from, const std::string& to) const {
    for (const std::string ending : {".surfaces", ".bt"})
      fs::copy_file(folder / (from + ending), folder / (to + ending), fs::copy_options::overwrite_existing);
  }
  void remove(const std::vector<std::string>& names) const {
    for (const std::string& name : names) fs::remove(folder / name);
  }
  /// Of a sound map.
  std::size_t scans_in(const std::string& map) const {
    const LoadedMap loaded = load_map(folder / map);
    EXPECT_THAT(check_invariants(loaded.map), IsEmpty());
    return loaded.map.size().scans;
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
class EarlyEnd : public EndsEarly {};
class FailingRun : public EndsEarly {};
class Killed : public EndsEarly {};

TEST_F(EarlyEnd, AnUnreadableScanStopsTheRunWithItsNameOrIsSkipped) {
  write_floor();
  run_well("map floor -o three --first 3");
  truncate("floor/3.pgm");
  fails("map floor -o m --report r.json", {"3.pgm", "3 scans mapped and saved", "--skip-bad"});
  EXPECT_EQ(read_json("r.json").at("scans"), 3);
  EXPECT_TRUE(same_maps("m", "three"));
  EXPECT_THAT(run_well("map floor -o n --report n.json --skip-bad").out, says("1 skipped"));
  const json report = read_json("n.json"), skipped = report.at("skipped_scans");
  EXPECT_EQ(report.at("scans"), 5);
  ASSERT_EQ(skipped.size(), 1u);
  EXPECT_THAT(skipped[0].get<std::string>(), says("3.pgm"));
  EXPECT_EQ(info("n").at("scans"), 5);
}

TEST_F(EarlyEnd, ABadFirstScanLeavesNothingBehind) {
  write_floor("floor", 2);
  truncate("floor/0.pgm");
  fails("map floor -o m --report r.json", {"0.pgm"});
  EXPECT_EQ(files("m.") + files("r"), 0);
  truncate("floor/1.pgm");
  fails("map floor -o m --skip-bad", {"none of the 2 scans"});
  EXPECT_FALSE(exists("m.surfaces"));
}

TEST_F(EarlyEnd, SignalsSaveWhatIsMapped) {
  write_floor("floor", 60);
  write_times("floor", 60, 10);
  for (const std::vector<int>& signals : {std::vector{SIGINT}, {SIGINT, SIGINT}, {SIGHUP}, {SIGTERM}}) {
    remove({"m.surfaces", "m.bt"});
    Running run(folder, {"map", "floor", "-o", "m", "--realtime", "--checkpoint", "0.000001"});
    ASSERT_TRUE(run.wait_until([&] { return exists("m.surfaces"); })) << run.errors();
    for (const int signal : signals) run.send(signal);
    EXPECT_EQ(run.wait(), 1) << run.errors();
    EXPECT_THAT(run.errors(), says("interrupted", "mapped and saved", "--resume m"));
    const int scans = info("m").at("scans");
    EXPECT_GE(scans, 1);
    EXPECT_LT(scans, 60);
  }
}

TEST_F(EarlyEnd, ASignalEndsTheScanThatIsBeingMapped) {
  simulate_room();
  Running run(folder, {"map", "room", "-o", "m", "--resolution", "0.003"});  // seconds a scan
  ASSERT_TRUE(run.wait_until([&] { return exists("m.lock"); })) << run.errors();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  run.send(SIGTERM);
  EXPECT_EQ(run.wait(), 1);
  EXPECT_THAT(run.errors(), says("interrupted before a scan was mapped; nothing is written"));
  EXPECT_FALSE(exists("m.surfaces") || exists("m.lock"));
}

/// Whether a signal comes before the work, during it or while the map is saved.
TEST_F(EarlyEnd, ASignalLeavesNoLockNorPartOfAnyVerbThatWritesAMap) {
  write_floor();
  run_well("map floor -o m --first 3 --keep-scans scans");
  run_well("map floor -o other --skip 3");
  const std::string before = read("m.surfaces");
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"merge", "m", "other", "-o", "new"},
        {"remap", "m", "-o", "new"},
        {"clear", "m", "--box", "0", "0", "-1", "1", "1", "1", "-o", "new"}})
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      Running run(folder, verb);
      run.wait_until([&] { return exists("new.lock"); });
      run.send(signal);
      const int code = run.wait();
      EXPECT_TRUE(code == 0 || code == 1) << verb[0] << " ended by " << code;
      if (code == 1) {
        EXPECT_THAT(run.errors(), says("octosurf " + verb[0] + ": interrupted"));
      }
      EXPECT_EQ(exists("new.surfaces"), code == 0);
      remove({"new.surfaces", "new.bt"});
      EXPECT_EQ(files("new"), 0) << verb[0];
    }
  EXPECT_EQ(read("m.surfaces"), before);
}

TEST_F(FailingRun, ACheckpointThatFailsIsToldOnceAndTheRunGoesOn) {
  write_floor("floor", 400);
  write_times("floor", 400, 20);
  Running run(folder, {"map", "floor", "-o", "m", "--realtime", "--checkpoint", "0.02"});
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
  EXPECT_THAT(errors, says("m.surfaces: ", "the last complete checkpoint is m ", "the run goes on",
                           "mapped and saved"));
  scans_in("m");
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
  const std::string last = "the last complete checkpoint is m with ", &line = outcome.errors.back();
  for (std::size_t i = 0; i + 1 < outcome.errors.size(); ++i)
    EXPECT_THAT(outcome.errors[i], says("warning: no checkpoint", "File too large", last));
  EXPECT_THAT(
      line, says("octosurf map: m.surfaces: cannot be written: File too large", last, "--resume m goes on"));
  const int scans = scans_told(line);
  EXPECT_GE(scans, 6);
  EXPECT_EQ(info("m").at("scans"), scans);
  EXPECT_FALSE(exists("r.json"));
  // And with nothing saved before it, nothing is there. Of few scans: stderr may not become larger, either.
  const Outcome none = run("map floor -o n --first 2", "ulimit -f 1;");
  EXPECT_EQ(none.code, 1);
  ASSERT_EQ(none.errors.size(), 1u) << none.err;
  EXPECT_THAT(none.errors[0], says("no checkpoint of this run was complete"));
  EXPECT_FALSE(exists("n.surfaces") || exists("n.bt"));
}

TEST_F(FailingRun, TooFewFilesNameTheirLimit) {
  write_floor("floor", 2);
  const std::string no_others = "exec 3>&- 4>&- 5>&- 6>&- 7>&- 8>&- 9>&-; prlimit --nofile=";
  for (const char* limit : {"5", "6"})
    EXPECT_THAT(run("map floor -o n", no_others + limit).err,
                AllOf(HasSubstr("(ulimit -n)"), Not(HasSubstr("disk;"))));
}

TEST_F(FailingRun, NoMemoryKeepsWhatWasMapped) {
  if (sanitized) GTEST_SKIP() << "a sanitizer needs more address space than any limit leaves";
  constexpr int images = 160;
  write_floor("floor", images);
  // A new place for each image, and noise: a file of equal floors shrinks so far that it is taken for a bomb.
  std::vector<Eigen::Isometry3d> poses = floor_poses(images);
  std::mt19937_64 noise = rng();
  for (std::size_t i = 0; i < images; ++i) {
    poses[i].translation() << 3.0 * static_cast<double>(i % 20), 3.0 * static_cast<double>(i / 20), 1;
    write_depths("floor/" + std::to_string(i) + ".pgm", 80, 60,
                 [&](int, int) { return 998 + static_cast<double>(noise() % 5); });
  }
  write_poses("floor/poses.txt", poses);
  int named = 0;
  for (int limit_mb = 200; limit_mb <= 440 && named == 0; limit_mb += 40) {
    remove({"m.surfaces", "m.bt"});
    const Outcome outcome =
        run("map floor -o m --checkpoint 0.05", "ulimit -v " + std::to_string(1024 * limit_mb) + ";");
    SCOPED_TRACE(std::to_string(limit_mb) + " MB: " + outcome.err);
    if (outcome.code == 0 || outcome.code == 127) continue;  // enough, or too little to be loaded
    EXPECT_EQ(outcome.code, 1);
    ASSERT_FALSE(outcome.errors.empty());
    const std::string& line = outcome.errors.back();
    EXPECT_TRUE(std::all_of(outcome.errors.begin(), outcome.errors.end() - 1, [](const auto& text) {
      return text.starts_with("warning: no checkpoint") ||
             text.starts_with("warning: scans contradict each other");
    }));
    EXPECT_THAT(line, AnyOf(HasSubstr("memory"), HasSubstr("shared libraries")));
    const int scans = scans_told(line);
    if (scans < 0) continue;
    ++named;
    EXPECT_EQ(info("m").at("scans"), scans);
  }
  EXPECT_GT(named, 0) << "no limit let it map some and then run out of memory";
}

/// How many kills: OCTOSURF_KILLS, else few, so that the suite stays fast.
int kills() {
  const char* given = std::getenv("OCTOSURF_KILLS");
  return given != nullptr ? std::stoi(given) : 18;
}

/// Whenever it is killed, what is there loads, is sound, and ends like a run that nobody killed; so do the
/// scans that every third run keeps.
TEST_F(Killed, AtAnyMomentItsLastCheckpointGoesOn) {
  constexpr std::size_t images = 14, seeded = 3;
  write_floor("floor", images);
  run_well("map floor -o whole");
  run_well("map floor -o another --keep-scans whole.scans");
  run_well("map floor -o seed --first 3");
  run_well("map floor -o keeping --first 3 --keep-scans scans");
  // Goes on with the seed and saves all the time.
  const std::vector<std::string> going_on{"map", "floor",        "--resume", "m",         "--skip",
                                          "3",   "--checkpoint", "0.000001", "--threads", "1"};
  copy_map("seed", "m");
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(Running(folder, going_on).wait(), 0);
  const auto whole = std::chrono::steady_clock::now() - start;
  std::mt19937_64 random(seed());
  int killed = 0, advanced = 0, inside = 0;
  for (const int wanted = kills(); killed < wanted && !HasFailure();) {
    const bool keeps = killed % 3 == 2;
    const std::string begun = keeps ? "keeping" : "seed";
    copy_map(begun, "m");
    Running run(folder, going_on);
    std::this_thread::sleep_for(whole * std::uniform_real_distribution<double>(0, 1)(random));
    run.send(SIGKILL);
    if (run.wait() != 128 + SIGKILL) continue;  // it was done already
    ++killed;
    inside += files("m.surfaces-journal") + files("m.bt.part") > 0;
    advanced += read("m.surfaces") != read(begun + ".surfaces");
    const std::size_t scans = scans_in("m");
    SCOPED_TRACE("killed after " + std::to_string(scans) + " scans of " + begun);
    EXPECT_GE(scans, seeded);
    if (keeps) {
      EXPECT_NO_THROW(io::kept_scans(folder / "scans", scans));
    }
    if (scans < images) {  // --skip would leave none
      run_well("map floor --resume m --skip " + std::to_string(scans));
    } else {  // its .bt may be of an earlier one
      const LoadedMap loaded = load_map(folder / "m");
      save_map(loaded.map, folder / "m", loaded.scans);
    }
    EXPECT_TRUE(same_maps("m", "whole"));
    EXPECT_EQ(files("m."), 2) << "what the killed run has left";
    if (keeps) {
      for (const fs::path& scan : io::kept_scans(folder / "scans", images))
        EXPECT_TRUE(read(scan.string()) == read("whole.scans/" + scan.filename().string())) << scan;
      run_well("remap m -o n --force");
    }
  }
  std::cout << killed << " kills, " << advanced << " of them after a checkpoint of its own, " << inside
            << " inside a save\n";
  EXPECT_GT(inside, 0);
  EXPECT_GT(advanced, 0) << "no run has come as far as a checkpoint";
}

}  // namespace
}  // namespace octosurf::test
