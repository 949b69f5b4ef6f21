// What `octosurf view` takes and refuses; what its page does is test/web's.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ViewVerb : public CommandTest {
 protected:
  ViewVerb() {
    write_floor();
    run_well("map floor -o m");
  }

  bool has_page() const { return run("view m --foot none --html probe.html").code == 0; }
};

TEST_F(ViewVerb, RefusesFeetThatAreNone) {
  EXPECT_THAT(error_of("view m --foot big", 2), HasSubstr("--foot big"));
  EXPECT_THAT(error_of("view m --foot 0.2x0.1@north", 2), AllOf(HasSubstr("@"), HasSubstr("0.22x0.11@90")));
  EXPECT_THAT(error_of("view m --foot -1", 2), HasSubstr("radius"));
  EXPECT_FALSE(exists("m.html"));
}

TEST_F(ViewVerb, RefusesPlansThatAreNoneByName) {
  for (const std::string none : {"nothing.json", "/dev/zero", "/proc"})  // one of no end, and a folder
    EXPECT_THAT(error_of("view m --plan " + none, 1), HasSubstr(none + ": cannot be read"));
  if (!has_page()) GTEST_SKIP() << "built without the page";
  const std::string head =
      R"({"format":"octosurf-plan","version":1,"found":true,"cost":1,"body":[],"start":[],)";
  for (
      const std::string& text : std::vector<std::string>{
          "", "[1,2]", "{}", R"({"format":"octosurf-plan","version":2})", head + R"("steps":7})",
          head + R"("steps":[{"foot":"wing"}]})", head + R"("steps":[7]})",
          head + R"("steps":[{"foot":"left","surface":1,"at":[1,2],"yaw_deg":0,"margin_m":0,"outline":[]}]})",
          head +
              R"("steps":[{"foot":"left","surface":1,"at":[1,2,1e999],"yaw_deg":0,"margin_m":0,"outline":[]}]})"}) {
    write("bad.json", text);
    EXPECT_THAT(error_of("view m --plan bad.json", 1), HasSubstr("bad")) << text;
    EXPECT_FALSE(exists("m.html"));
  }
}

TEST_F(ViewVerb, TakesSeveralFeetAndPlans) {
  if (!has_page()) GTEST_SKIP() << "built without the page";
  write("none.json",
        R"({"format":"octosurf-plan","version":1,"found":false,"start":[],"steps":[],"body":[]})");
  run_well("view m --foot 0.05 --foot 0.2x0.1@30 --plan none.json --plan none.json");
  EXPECT_TRUE(exists("m.html"));
  EXPECT_THAT(error_of("view m --plan m.html --html m.html --force", 2), HasSubstr("--html"));
}

TEST_F(ViewVerb, ShowsTheHistoryThatMapWrote) {
  run_well("map floor -o n --history n.history --skip 1");
  EXPECT_THAT(error_of("map floor -o o --history n.history", 2), HasSubstr("n.history"));
  EXPECT_THAT(error_of("view m n --history n.history", 2), HasSubstr("--history"));
  EXPECT_THAT(error_of("view m --history m.bt", 1), HasSubstr("is not a map's history"));
  write_floor("more", 9);
  run_well("map more -o n --resume n --history n.history");
  if (!has_page()) GTEST_SKIP() << "built without the page";
  run_well("view n --history n.history --html n.html");
  EXPECT_TRUE(exists("n.html"));
  EXPECT_THAT(error_of("view n --history n.history --html n.history --force", 2), HasSubstr("--html"));
}

TEST_F(ViewVerb, RefusesTheHistoryOfAnotherMap) {
  // The floor's only surface is born with scan 1 in the one, with scan 2 in the other.
  write("late/0.pcd",
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
        "VIEWPOINT 0 0 9 1 0 0 0\nPOINTS 1\nDATA ascii\n0 0 1\n");
  run_well("map late floor -o n --history n.history");
  EXPECT_THAT(error_of("view m --history n.history", 1), HasSubstr("is not the history of m"));
  EXPECT_THAT(error_of("map floor -o m --resume m --history n.history", 2), HasSubstr("of another map"));
  run_well("map floor -o m --resume m --history n.history --force");
}

}  // namespace
}  // namespace octosurf::test
