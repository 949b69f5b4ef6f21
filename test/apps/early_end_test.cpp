// Bad scans and interrupts: nothing is lost of what was mapped.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class EarlyEnd : public CommandTest {
 protected:
  void truncate(const std::string& file) const { write(file, read(file).substr(0, 100)); }
};

TEST_F(EarlyEnd, AnUnreadableScanStopsTheRunWithItsName) {
  write_floor();
  truncate("floor/3.pgm");
  EXPECT_THAT(error_of("map floor -o m --report r.json", 1),
              AllOf(HasSubstr("3.pgm"), HasSubstr("3 scans mapped and saved"), HasSubstr("--skip-bad")));
  EXPECT_EQ(read_json("r.json").at("scans"), 3);
  run_well("map floor -o three --first 3");
  EXPECT_EQ(read("m.surfaces"), read("three.surfaces"));
  EXPECT_EQ(read("m.bt"), read("three.bt"));
}

TEST_F(EarlyEnd, ABadFirstScanLeavesNothingBehind) {
  write_floor();
  truncate("floor/0.pgm");
  EXPECT_THAT(error_of("map floor -o m --report r.json", 1), HasSubstr("0.pgm"));
  EXPECT_FALSE(exists("m.surfaces") || exists("m.bt") || exists("r.json"));
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

TEST_F(EarlyEnd, AnInterruptSavesWhatIsMapped) {
  write_floor();
  // A scan every second: at 3.2 s four have arrived, none of the others can have; a busy machine has 3 s to
  // start.
  const Outcome outcome = run("map floor -o m --realtime --rate 1", "timeout --preserve-status -s INT 3.2");
  EXPECT_EQ(outcome.code, 1);
  ASSERT_EQ(outcome.errors.size(), 1u) << outcome.err;
  EXPECT_THAT(outcome.errors[0],
              AllOf(HasSubstr("interrupted"), HasSubstr("mapped and saved"), HasSubstr("--resume m")));
  const int scans = info("m").at("scans");
  EXPECT_GE(scans, 1);
  EXPECT_LE(scans, 4);
}

TEST_F(EarlyEnd, TwoInterruptsAtOnceAreOne) {
  write_floor();
  const Outcome outcome =
      run("map floor -o m --realtime --rate 1",
          "sh -c '\"$@\" & run=$!; sleep 3.2; kill -INT $run; sleep 0.01; kill -INT $run; wait $run' sh");
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_GE(info("m").at("scans"), 1);
}

TEST_F(EarlyEnd, CheckpointsSurviveAKill) {
  write_floor();
  // A kill before the first checkpoint is there leaves no map: a busy machine has 30 s for it.
  const Outcome outcome = run("map floor -o m --realtime --rate 2 --checkpoint 0.2",
                              "sh -c '\"$@\" & run=$!; for i in $(seq 600); do [ -e m.surfaces ] && break; "
                              "sleep 0.05; done; sleep 0.7; "
                              "kill -KILL $run; wait $run' sh");
  EXPECT_EQ(outcome.code, 137);
  const int scans = info("m").at("scans");
  EXPECT_GE(scans, 1);
  EXPECT_LE(scans, 5);
}

}  // namespace
}  // namespace octosurf::test
