// Bad scans and interrupts: nothing is lost of what was mapped.
#include "apps/command.hpp"
#include "apps/running.hpp"
#include "io/readers/bag.hpp"

#include <algorithm>
#include <chrono>
#include <gmock/gmock.h>
#include <thread>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class EarlyEnd : public CommandTest {
 protected:
  void truncate(const std::string& file) const { write(file, read(file).substr(0, 100)); }
  /// Of a log, which must be whole.
  int messages(const std::string& log, const std::string& topic) const {
    const auto bag = io::open_mcap(folder / log);
    int count = 0;
    bag->read_all([&](const io::BagMessage& message) { count += bag->topics()[message.topic].name == topic; },
                  nullptr);
    return count;
  }
  /// Files whose names begin like this: a temporary one's does with the name of what it becomes.
  std::ptrdiff_t files(const std::string& beginning) const {
    const std::filesystem::directory_iterator all(folder);
    return std::count_if(begin(all), end(all), [&](const auto& entry) {
      return entry.path().filename().string().starts_with(beginning);
    });
  }
};

TEST_F(EarlyEnd, AnUnreadableScanStopsTheRunWithItsName) {
  write_floor();
  truncate("floor/3.pgm");
  EXPECT_THAT(error_of("map floor -o m --report r.json --mcap run.mcap", 1),
              AllOf(HasSubstr("3.pgm"), HasSubstr("3 scans mapped and saved"), HasSubstr("--skip-bad")));
  EXPECT_EQ(read_json("r.json").at("scans"), 3);
  run_well("map floor -o three --first 3");
  EXPECT_EQ(read("m.surfaces"), read("three.surfaces"));
  EXPECT_EQ(read("m.bt"), read("three.bt"));
  EXPECT_EQ(messages("run.mcap", "/tf"), 3);
  EXPECT_GE(messages("run.mcap", "/surfaces"), 2);
  EXPECT_EQ(files("run.mcap"), 1);
}

TEST_F(EarlyEnd, ABadFirstScanLeavesNothingBehind) {
  write_floor();
  truncate("floor/0.pgm");
  EXPECT_THAT(error_of("map floor -o m --report r.json --mcap run.mcap", 1), HasSubstr("0.pgm"));
  EXPECT_FALSE(exists("m.surfaces") || exists("m.bt") || exists("r.json"));
  EXPECT_EQ(files("run.mcap"), 0);
}

TEST_F(EarlyEnd, SkipBadGoesOnAndReports) {
  write_floor();
  truncate("floor/3.pgm");
  EXPECT_THAT(run_well("map floor -o m --report r.json --skip-bad").out, HasSubstr("1 skipped"));
  const nlohmann::json report = read_json("r.json");
  EXPECT_EQ(report.at("scans"), 5);
  ASSERT_EQ(report.at("skipped_scans").size(), 1u);
  EXPECT_THAT(report.at("skipped_scans")[0].get<std::string>(), HasSubstr("3.pgm"));
  EXPECT_EQ(info("m").at("scans"), 5);
}

TEST_F(EarlyEnd, NoGoodScanAtAll) {
  write_floor("floor", 2);
  truncate("floor/0.pgm");
  truncate("floor/1.pgm");
  EXPECT_THAT(error_of("map floor -o m --skip-bad", 1), HasSubstr("none of the 2 scans"));
  EXPECT_FALSE(exists("m.surfaces"));
}

TEST_F(EarlyEnd, APoseThatIsNotRigidStopsTheRun) {
  write_floor("floor", 3);
  write("poses.txt",
        "1 0 0 0  0 -1 0 0  0 0 -1 1\n1 0 0 0  0 -1 0 0  0 0 -1 1\n2 0 0 0  0 -2 0 0  0 0 -2 1\n");
  EXPECT_THAT(error_of("map floor -o m --poses poses.txt", 1), AllOf(HasSubstr("2.pgm"), HasSubstr("rigid")));
  EXPECT_EQ(info("m").at("scans"), 2);
  EXPECT_THAT(run_well("map floor -o m --poses poses.txt --skip-bad --force").out, HasSubstr("1 skipped"));
}

TEST_F(EarlyEnd, SignalsSaveWhatIsMapped) {
  write_floor("floor", 60);
  for (const std::vector<int>& signals : {std::vector{SIGINT}, {SIGINT, SIGINT}, {SIGHUP}, {SIGTERM}}) {
    for (const char* file : {"m.surfaces", "m.bt", "m.mcap"}) std::filesystem::remove(folder / file);
    Running run(folder, {"map", "floor", "-o", "m", "--realtime", "--rate", "10", "--checkpoint", "0.000001",
                         "--mcap", "m.mcap"});
    ASSERT_TRUE(run.wait_until([&] { return exists("m.surfaces"); })) << run.errors();
    for (const int signal : signals) run.send(signal);
    EXPECT_EQ(run.wait(), 1) << run.errors();
    EXPECT_THAT(run.errors(),
                AllOf(HasSubstr("interrupted"), HasSubstr("mapped and saved"), HasSubstr("--resume m")));
    const int scans = info("m").at("scans");
    EXPECT_GE(scans, 1);
    EXPECT_LT(scans, 60);
    EXPECT_EQ(messages("m.mcap", "/tf"), scans) << "the log is whole, too";
  }
}

TEST_F(EarlyEnd, ASignalEndsTheScanThatIsBeingMapped) {
  simulate_room();
  Running run(folder, {"map", "room", "-o", "m", "--resolution", "0.003"});  // seconds a scan
  ASSERT_TRUE(run.wait_until([&] { return exists("m.lock"); })) << run.errors();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  run.send(SIGTERM);
  EXPECT_EQ(run.wait(), 1);
  EXPECT_THAT(run.errors(), HasSubstr("interrupted before a scan was mapped; nothing is written"));
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
        {"clear", "m", "--box", "0", "0", "-1", "1", "1", "1", "-o", "new"}}) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      Running run(folder, verb);
      run.wait_until([&] { return exists("new.lock"); });
      run.send(signal);
      const int code = run.wait();
      EXPECT_TRUE(code == 0 || code == 1) << verb[0] << " ended by " << code;
      if (code == 1) {
        EXPECT_THAT(run.errors(), HasSubstr("octosurf " + verb[0] + ": interrupted"));
      }
      EXPECT_EQ(exists("new.surfaces"), code == 0);
      for (const char* file : {"new.surfaces", "new.bt"}) std::filesystem::remove(folder / file);
      EXPECT_EQ(files("new"), 0) << verb[0];
    }
  }
  EXPECT_EQ(read("m.surfaces"), before);
}

}  // namespace
}  // namespace octosurf::test
