// What `octosurf view` takes and refuses; what its page does is test/web's.
#include "apps/command.hpp"

#include <gmock/gmock.h>

namespace octosurf::test {
namespace {

using ::testing::HasSubstr;

class ViewVerb : public CommandTest {
 protected:
  ViewVerb() {
    write_floor();
    run_well("map floor -o m");
  }

  bool has_page() const { return run("view m --foot none --html probe.html").code == 0; }
};

TEST_F(ViewVerb, RefusesPlansThatAreNoneByName) {
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

}  // namespace
}  // namespace octosurf::test
